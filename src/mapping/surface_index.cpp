// SPDX-License-Identifier: BSD-3-Clause
// Nearest neighbours on a surface: samples sorted into cells, cells in a hash table.
#include <algorithm>
#include <array>

#include "plumbline/mapping/local_map_alignment.hpp"
#include "surface_voxels.hpp"

namespace plumbline::mapping {
namespace {

/// Spreads neighbouring keys over the table (Fibonacci hashing).
std::size_t mix(std::uint64_t key) { return static_cast<std::size_t>(key * 0x9E3779B97F4A7C15ULL >> 24); }

}  // namespace

SurfaceIndex::SurfaceIndex(CoarseSurface surface, double reach_m)
    : cell_m_(static_cast<float>(2.0 * reach_m)) {
  std::vector<std::pair<std::uint64_t, std::uint32_t>> order(surface.size());
  for (std::size_t i = 0; i < surface.size(); ++i) {
    order[i] = {voxel_key(surface[i].point, cell_m_), static_cast<std::uint32_t>(i)};
  }
  std::sort(order.begin(), order.end());
  samples_.reserve(surface.size());
  for (const auto& [key, i] : order) {
    if (cells_.empty() || cells_.back().key != key) {
      const auto begin = static_cast<std::uint32_t>(samples_.size());
      cells_.push_back({key, begin, begin});
    }
    samples_.push_back(surface[i]);
    ++cells_.back().end;
  }
  std::size_t slots = 16;
  while (slots < 2 * cells_.size()) slots *= 2;
  table_.assign(slots, 0);
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    std::size_t slot = mix(cells_[i].key) & (slots - 1);
    while (table_[slot] != 0) slot = (slot + 1) & (slots - 1);
    table_[slot] = static_cast<std::uint32_t>(i + 1);
  }
}

const SurfaceIndex::Cell* SurfaceIndex::find(std::uint64_t key) const {
  const std::size_t mask = table_.size() - 1;
  for (std::size_t slot = mix(key) & mask; table_[slot] != 0; slot = (slot + 1) & mask) {
    const Cell& cell = cells_[table_[slot] - 1];
    if (cell.key == key) return &cell;
  }
  return nullptr;
}

const maps::SurfaceSample* SurfaceIndex::nearest(const Eigen::Vector3f& point, const Eigen::Vector3f& normal,
                                                 float distance_m, float min_cosine) const {
  // Cells are twice the reach wide: what is within reach lies in the eight cells around the nearest corner.
  const maps::SurfaceSample* best = nullptr;
  float best_squared = distance_m * distance_m;
  std::array<std::uint64_t, 8> seen{};
  std::size_t count = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3f probe(point.x() + ((corner & 1) != 0 ? distance_m : -distance_m),
                                point.y() + ((corner & 2) != 0 ? distance_m : -distance_m),
                                point.z() + ((corner & 4) != 0 ? distance_m : -distance_m));
    const std::uint64_t key = voxel_key(probe, cell_m_);
    if (std::find(seen.begin(), seen.begin() + static_cast<std::ptrdiff_t>(count), key) !=
        seen.begin() + static_cast<std::ptrdiff_t>(count)) {
      continue;
    }
    seen[count++] = key;
    const Cell* cell = find(key);
    if (cell == nullptr) continue;
    for (std::uint32_t i = cell->begin; i < cell->end; ++i) {
      const float squared = (samples_[i].point - point).squaredNorm();
      if (squared < best_squared && samples_[i].normal.dot(normal) >= min_cosine) {
        best_squared = squared;
        best = &samples_[i];
      }
    }
  }
  return best;
}

}  // namespace plumbline::mapping
