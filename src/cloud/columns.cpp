// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/cloud/columns.hpp"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <tuple>
#include <vector>

namespace plumbline::cloud {
namespace {

bool before_in_order(const Point& a, const Point& b) {
  return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z);
}
bool same_place(const Point& a, const Point& b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

template <typename T>
std::vector<T> picked(const std::vector<T>& column, const std::vector<std::size_t>& indices) {
  std::vector<T> result;
  if (column.empty()) return result;
  result.reserve(indices.size());
  for (const std::size_t i : indices) result.push_back(column[i]);
  return result;
}

/// Where each point of `after` is in `before`; empty when one is not there.
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
  std::vector<std::size_t> order(before.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
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

}  // namespace

CloudColumns carry_columns(const Cloud& before, const CloudColumns& columns, const Cloud& after) {
  CloudColumns carried;
  const std::vector<std::size_t> indices = find_all(before, after);
  if (indices.size() != after.size()) return carried;
  carried.confidence = picked(columns.confidence, indices);
  carried.observations = picked(columns.observations, indices);
  carried.robot = picked(columns.robot, indices);
  return carried;
}

}  // namespace plumbline::cloud
