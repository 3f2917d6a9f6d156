// SPDX-License-Identifier: BSD-3-Clause
#include "bounding_tree.hpp"

namespace plumbline::evaluate {

void BoundingTree::build(std::uint32_t first, std::uint32_t last, std::size_t leaf_size,
                         const std::vector<Box>& boxes) {
  Box box = boxes[order_[first]];
  Eigen::Vector3f low = box.min + box.max;  // twice the centres
  Eigen::Vector3f high = low;
  for (std::uint32_t i = first; i < last; ++i) {
    const Box& b = boxes[order_[i]];
    box.min = box.min.cwiseMin(b.min);
    box.max = box.max.cwiseMax(b.max);
    low = low.cwiseMin(b.min + b.max);
    high = high.cwiseMax(b.min + b.max);
  }
  const std::size_t self = nodes_.size();
  nodes_.push_back({box, first, last, 0});
  if (last - first <= leaf_size) return;

  Eigen::Index axis = 0;
  (high - low).maxCoeff(&axis);
  const std::uint32_t middle = first + (last - first) / 2;
  const auto center = [&](std::uint32_t i) { return boxes[i].min(axis) + boxes[i].max(axis); };
  std::nth_element(order_.begin() + first, order_.begin() + middle, order_.begin() + last,
                   [&](std::uint32_t a, std::uint32_t b) {
                     const float ca = center(a);
                     const float cb = center(b);
                     return ca != cb ? ca < cb : a < b;
                   });
  build(first, middle, leaf_size, boxes);
  nodes_[self].right = static_cast<std::uint32_t>(nodes_.size());
  build(middle, last, leaf_size, boxes);
}

}  // namespace plumbline::evaluate
