// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Axis-aligned bounding boxes in a binary tree, for exact nearest-neighbour search over points or triangles.
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace plumbline::evaluate {

struct Box {
  Eigen::Vector3f min;
  Eigen::Vector3f max;
  [[nodiscard]] double squared_distance(const Eigen::Vector3d& q) const {
    double sum = 0.0;
    for (Eigen::Index k = 0; k < 3; ++k) {
      const double d =
          std::max({static_cast<double>(min(k)) - q(k), 0.0, q(k) - static_cast<double>(max(k))});
      sum += d * d;
    }
    return sum;
  }
};

/// Splits at the median of the widest axis until `leaf_size` items are left. Items keep their given numbers;
/// `order()` lists them leaf by leaf, which is also an order in space that searches profit from.
class BoundingTree {
 public:
  /// `box_of(i)` for i in [0, count).
  template <typename BoxOf>
  BoundingTree(std::size_t count, std::size_t leaf_size, const BoxOf& box_of);

  [[nodiscard]] const std::vector<std::uint32_t>& order() const { return order_; }

  /// Calls `leaf(first, last)` (a range of order()) for every leaf that may hold something at squared
  /// distance
  /// < `bound`, near ones first (not <=: heaps of equal points would all be visited). `leaf` lowers `bound`
  /// as it finds nearer items.
  template <typename Leaf>
  void search(const Eigen::Vector3d& q, const double& bound, const Leaf& leaf) const;

 private:
  struct Node {
    Box box;
    std::uint32_t first = 0;
    std::uint32_t last = 0;
    std::uint32_t right = 0;  ///< the left child follows its parent; 0 = leaf
  };
  void build(std::uint32_t first, std::uint32_t last, std::size_t leaf_size, const std::vector<Box>& boxes);

  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;
};

template <typename BoxOf>
BoundingTree::BoundingTree(std::size_t count, std::size_t leaf_size, const BoxOf& box_of) {
  std::vector<Box> boxes(count);
  order_.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    boxes[i] = box_of(i);
    order_[i] = static_cast<std::uint32_t>(i);
  }
  if (count > 0) build(0, static_cast<std::uint32_t>(count), leaf_size, boxes);
}

template <typename Leaf>
void BoundingTree::search(const Eigen::Vector3d& q, const double& bound, const Leaf& leaf) const {
  if (nodes_.empty()) return;
  struct Entry {
    double squared_distance;
    std::uint32_t node;
  };
  std::array<Entry, 128> stack;  // one entry a level; splitting at the median keeps the depth below 33
  std::size_t size = 0;
  stack[size++] = {nodes_[0].box.squared_distance(q), 0};
  while (size > 0) {
    const Entry entry = stack[--size];
    if (entry.squared_distance >= bound) continue;
    const Node& node = nodes_[entry.node];
    if (node.right == 0) {
      leaf(node.first, node.last);
      continue;
    }
    Entry near{nodes_[entry.node + 1].box.squared_distance(q), entry.node + 1};
    Entry far{nodes_[node.right].box.squared_distance(q), node.right};
    if (far.squared_distance < near.squared_distance) std::swap(near, far);
    if (far.squared_distance < bound) stack[size++] = far;
    if (near.squared_distance < bound) stack[size++] = near;
  }
}

}  // namespace plumbline::evaluate
