// SPDX-License-Identifier: BSD-3-Clause
// Nearest neighbours on a surface: samples sorted into cells, cells in a hash table.
#include <algorithm>

#include "plumbline/mapping/local_map_alignment.hpp"
#include "surface_voxels.hpp"

namespace plumbline::mapping {
namespace {

/// Spreads neighbouring keys over the table (Fibonacci hashing).
std::size_t mix(std::uint64_t key) { return static_cast<std::size_t>(key * 0x9E3779B97F4A7C15ULL >> 24); }

}  // namespace

SurfaceIndex::SurfaceIndex(CoarseSurface surface, double reach_m) : cell_m_(static_cast<float>(reach_m)) {
  std::vector<std::pair<std::uint64_t, std::uint32_t>> order(surface.size());
  for (std::size_t i = 0; i < surface.size(); ++i) {
    order[i] = {voxel_key(surface[i].point, 2.0F * cell_m_), static_cast<std::uint32_t>(i)};
  }
  std::sort(order.begin(), order.end());
  samples_.reserve(surface.size());
  for (const auto& [key, i] : order) samples_.push_back(surface[i]);
  make_cells();
}

void SurfaceIndex::make_cells() {
  std::vector<std::pair<std::uint64_t, std::uint32_t>> order(samples_.size());
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    order[i] = {voxel_key(samples_[i].point, cell_m_), static_cast<std::uint32_t>(i)};
  }
  std::sort(order.begin(), order.end());
  places_.reserve(order.size());
  for (const auto& [key, i] : order) {
    if (cells_.empty() || cells_.back().key != key) {
      const auto begin = static_cast<std::uint32_t>(places_.size());
      cells_.push_back({key, begin, begin});
    }
    places_.push_back({samples_[i].point, i});
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
  const maps::SurfaceSample* best = nullptr;
  float best_squared = distance_m * distance_m;
  const auto visit = [&](const Eigen::Vector3f& in_cell) {
    const Cell* cell = find(voxel_key(in_cell, cell_m_));
    if (cell == nullptr) return;
    for (std::uint32_t i = cell->begin; i < cell->end; ++i) {
      const float squared = (places_[i].point - point).squaredNorm();
      if (!(squared < best_squared)) continue;
      const maps::SurfaceSample& sample = samples_[places_[i].sample];
      if (sample.normal.dot(normal) < min_cosine) continue;
      best_squared = squared;
      best = &sample;
    }
  };
  // The point's own cell first; of those around only such as reach nearer than the best so far.
  visit(point);
  const Eigen::Vector3f low = (point / cell_m_).array().floor().matrix() * cell_m_;
  const Eigen::Vector3f below = point - low;
  constexpr float kRounding_m = 1e-5F;
  const auto gap_squared = [&](int axis, int step) {
    if (step == 0) return 0.0F;
    const float gap = (step < 0 ? below[axis] : cell_m_ - below[axis]) - kRounding_m;
    return gap > 0.0F ? gap * gap : 0.0F;
  };
  for (int x = -1; x <= 1; ++x) {
    const float gap_x = gap_squared(0, x);
    if (gap_x >= best_squared) continue;
    for (int y = -1; y <= 1; ++y) {
      const float gap_xy = gap_x + gap_squared(1, y);
      if (gap_xy >= best_squared) continue;
      for (int z = -1; z <= 1; ++z) {
        if ((x == 0 && y == 0 && z == 0) || gap_xy + gap_squared(2, z) >= best_squared) continue;
        // The middle of the cell: its number has no doubt.
        visit(low + Eigen::Vector3f(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F,
                                    static_cast<float>(z) + 0.5F) *
                        cell_m_);
      }
    }
  }
  return best;
}

}  // namespace plumbline::mapping
