// SPDX-License-Identifier: BSD-3-Clause
#include "voxel_buckets.hpp"

#include <algorithm>
#include <cmath>

namespace plumbline::evaluate {

VoxelBuckets::VoxelBuckets(const std::vector<Eigen::Vector3f>& points, double edge_m) {
  struct Entry {
    Key key;
    std::uint32_t point;
  };
  std::vector<Entry> entries(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      const double p = static_cast<double>(points[i](static_cast<Eigen::Index>(k)));
      entries[i].key[k] = static_cast<std::int64_t>(std::clamp(std::floor(p / edge_m), -1e15, 1e15));
    }
    entries[i].point = static_cast<std::uint32_t>(i);
  }
  std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
    return a.key != b.key ? a.key < b.key : a.point < b.point;
  });
  order_.reserve(entries.size());
  for (const Entry& entry : entries) {
    const auto rank = static_cast<std::uint32_t>(order_.size());
    if (cells_.empty() || cells_.back().key != entry.key) cells_.push_back({entry.key, rank, rank});
    cells_.back().last = rank + 1;
    order_.push_back(entry.point);
  }
}

std::vector<std::uint32_t> VoxelBuckets::points_of(std::size_t voxel) const {
  return {order_.begin() + cells_[voxel].first, order_.begin() + cells_[voxel].last};
}

const VoxelBuckets::Cell* VoxelBuckets::find(const Key& key) const {
  const auto at = std::lower_bound(cells_.begin(), cells_.end(), key,
                                   [](const Cell& cell, const Key& k) { return cell.key < k; });
  return at != cells_.end() && at->key == key ? &*at : nullptr;
}

}  // namespace plumbline::evaluate
