// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/cloud/columns.hpp"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/search/kdtree.h>

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <memory>
#include <tuple>
#include <vector>

#include "filters/filter_tools.hpp"

namespace plumbline::cloud {
namespace {

bool before_in_order(const Point& a, const Point& b) {
  return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z);
}
bool same_place(const Point& a, const Point& b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

// The values at the given indices; an empty column stays empty.
template <typename T>
std::vector<T> picked(const std::vector<T>& column, const std::vector<std::size_t>& indices) {
  std::vector<T> result;
  if (column.empty()) return result;
  result.reserve(indices.size());
  for (const std::size_t i : indices) result.push_back(column[i]);
  return result;
}

template <typename T>
void append(std::vector<T>& column, std::size_t size, const std::vector<T>& more, std::size_t added) {
  if (column.empty() && more.empty()) return;
  column.resize(size);
  column.insert(column.end(), more.begin(), more.end());
  column.resize(size + added);
}

std::vector<std::size_t> finite_indices(const Cloud& cloud) {
  std::vector<std::size_t> indices;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (finite(cloud[i])) indices.push_back(i);
  }
  return indices;
}

/// Organised clouds keep their shape: every point is at its old index, or removed.
bool same_places(const Cloud& before, const Cloud& after) {
  if (before.size() != after.size()) return false;
  for (std::size_t i = 0; i < after.size(); ++i) {
    if (finite(after[i]) && !same_place(before[i], after[i])) return false;
  }
  return true;
}

/// Index in `before` of each point of `after`; empty if one is not found.
std::vector<std::size_t> find_all(const Cloud& before, const Cloud& after) {
  std::vector<std::size_t> found;
  found.reserve(after.size());

  // Most filters keep the order: try that first.
  std::size_t next = 0;
  for (const Point& p : after.points) {
    while (next < before.size() && !same_place(before[next], p)) ++next;
    if (next == before.size()) break;
    found.push_back(next++);
  }
  if (found.size() == after.size()) return found;

  // Otherwise by search among the sorted points
  std::vector<std::size_t> order = finite_indices(before);  // NaN has no order
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return before_in_order(before[a], before[b]); });
  found.clear();

  for (const Point& p : after.points) {
    const auto at = std::lower_bound(order.begin(), order.end(), p, [&](std::size_t i, const Point& q) {
      return before_in_order(before[i], q);
    });
    if (at == order.end() || !same_place(before[*at], p)) return {};
    found.push_back(*at);
  }

  return found;
}

/// Index in `before` of the point nearest to each point of `after`; a point without finite coordinates gets
/// the first.
std::vector<std::size_t> nearest(const Cloud& before, const Cloud& after) {
  const auto points = std::make_shared<Cloud>();
  const std::vector<std::size_t> places = finite_indices(before);
  for (const std::size_t i : places) points->push_back(before[i]);
  std::vector<std::size_t> found(after.size(), 0);
  if (points->empty()) return found;

  pcl::search::KdTree<Point> tree;
  tree.setInputCloud(points);
  pcl::Indices index(1);
  std::vector<float> squared(1);
  for (std::size_t i = 0; i < after.size(); ++i) {
    if (!finite(after[i])) continue;
    tree.nearestKSearch(after[i], 1, index, squared);
    found[i] = places[static_cast<std::size_t>(index[0])];
  }

  return found;
}

}  // namespace

// The rows at the given indices, in all columns.
CloudColumns pick_columns(const CloudColumns& columns, const std::vector<std::size_t>& indices) {
  CloudColumns result;
  result.confidence = picked(columns.confidence, indices);
  result.observations = picked(columns.observations, indices);
  result.robot = picked(columns.robot, indices);
  for (const auto& other : columns.others) {
    result.others.push_back({other.name, picked(other.values, indices)});
  }
  return result;
}

void append_columns(CloudColumns& columns, std::size_t size, const CloudColumns& more, std::size_t added) {
  append(columns.confidence, size, more.confidence, added);
  append(columns.observations, size, more.observations, added);
  append(columns.robot, size, more.robot, added);

  // Columns that one side lacks are 0 there
  for (auto& other : columns.others) other.values.resize(size + added);
  for (const auto& other : more.others) {
    auto known = std::find_if(columns.others.begin(), columns.others.end(),
                              [&other](const auto& o) { return o.name == other.name; });
    if (known == columns.others.end()) {
      columns.others.push_back({other.name, std::vector<float>(size + added)});
      known = std::prev(columns.others.end());
    }
    std::copy(other.values.begin(), other.values.end(),
              known->values.begin() + static_cast<std::ptrdiff_t>(size));
  }
}

CloudColumns carry_columns(const Cloud& before, const CloudColumns& columns, const Cloud& after) {
  if (columns.empty()) return {};
  if (same_places(before, after)) return columns;

  // A filter that only chose points keeps their rows
  std::vector<std::size_t> indices = find_all(before, after);
  if (indices.size() != after.size()) {
    // Moved points: by order, else by the nearest
    if (before.size() == after.size()) return columns;
    indices = finite_indices(before);
    if (indices.size() != after.size()) indices = nearest(before, after);
  }
  return pick_columns(columns, indices);
}

}  // namespace plumbline::cloud
