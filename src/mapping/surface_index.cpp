// SPDX-License-Identifier: BSD-3-Clause
// Nearest neighbours on a surface: samples sorted into cells, the cells of one column one after another, so
// that those around a point are nine stretches of memory.
#include <algorithm>
#include <array>
#include <cmath>

#include "plumbline/core/clones.hpp"
#include "plumbline/mapping/local_map_alignment.hpp"
#include "surface_voxels.hpp"

namespace plumbline::mapping {
namespace {

using Floats = float __attribute__((vector_size(32), may_alias));
using Ints = std::int32_t __attribute__((vector_size(32)));
static_assert(sizeof(Floats) == sizeof(float) * SurfaceIndex::kLanes);

/// Of the grid whose first cell is `first`; what lies beyond is in the cell at its edge, what is no number as
/// well.
inline Eigen::Vector3i cell_of(const Eigen::Vector3f& point, const Eigen::Vector3f& first, float cell_m) {
  Eigen::Vector3i cell;
  for (int axis = 0; axis < 3; ++axis) {
    const float at = std::floor(point[axis] / cell_m) - first[axis];
    constexpr auto kLast = static_cast<float>(SurfaceIndex::kMostCells - 1);
    cell[axis] = static_cast<int>(at > 0.0F ? (at < kLast ? at : kLast) : 0.0F);
  }
  return cell;
}

/// Samples in the order of their cells: by x, then y, then z, then as they come.
std::vector<std::uint32_t> by_cell(const std::vector<Eigen::Vector3i>& cells) {
  std::vector<std::uint32_t> order(cells.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<std::uint32_t>(i);
  std::vector<std::uint32_t> sorted(order.size());
  std::vector<std::uint32_t> next;
  for (int axis = 2; axis >= 0; --axis) {
    next.assign(SurfaceIndex::kMostCells + 1, 0);
    for (const Eigen::Vector3i& cell : cells) ++next[static_cast<std::size_t>(cell[axis]) + 1];
    for (std::size_t i = 1; i < next.size(); ++i) next[i] += next[i - 1];
    for (const std::uint32_t i : order) sorted[next[static_cast<std::size_t>(cells[i][axis])]++] = i;
    order.swap(sorted);
  }
  return order;
}

}  // namespace

SurfaceIndex::SurfaceIndex(CoarseSurface surface, double reach_m)
    : cell_m_(static_cast<float>(reach_m)), samples_(std::move(surface)) {
  if (samples_.empty()) return;
  // Boxes of twice the reach: neighbours are searched for one after another.
  place_grid(2.0F * cell_m_);
  CoarseSurface sorted;
  sorted.reserve(samples_.size());
  for (const std::uint32_t i : by_cell(cells_of_samples(2.0F * cell_m_))) sorted.push_back(samples_[i]);
  samples_ = std::move(sorted);
  place_grid(cell_m_);
  fill_cells();
}

/// About the middle sample, so that what lies far away or nowhere does not matter.
void SurfaceIndex::place_grid(float cell_m) {
  const Eigen::Vector3f middle = (samples_[samples_.size() / 2].point / cell_m).array().floor();
  first_cell_ = middle.array() - static_cast<float>(kMostCells / 2);
}

std::vector<Eigen::Vector3i> SurfaceIndex::cells_of_samples(float cell_m) const {
  std::vector<Eigen::Vector3i> cells;
  cells.reserve(samples_.size());
  for (const maps::SurfaceSample& sample : samples_)
    cells.push_back(cell_of(sample.point, first_cell_, cell_m));
  return cells;
}

void SurfaceIndex::fill_cells() {
  const std::vector<Eigen::Vector3i> cells = cells_of_samples(cell_m_);
  Eigen::Vector3i low = cells.front();
  Eigen::Vector3i high = cells.front();
  for (const Eigen::Vector3i& cell : cells) {
    low = low.cwiseMin(cell);
    high = high.cwiseMax(cell);
  }
  corner_ = low.head<2>();
  extent_ = high.head<2>() - low.head<2>() + Eigen::Vector2i::Ones();
  columns_.assign(static_cast<std::size_t>(extent_.x()) * static_cast<std::size_t>(extent_.y()), {});
  places_ = by_cell(cells);
  blocks_.assign((places_.size() + kLanes - 1) / kLanes, {});
  for (std::size_t place = 0; place < kLanes * blocks_.size(); ++place) {
    Block& block = blocks_[place / kLanes];
    const std::size_t lane = place % kLanes;
    // The last block is filled up with what is near to nothing.
    const maps::SurfaceSample sample =
        place < places_.size()
            ? samples_[places_[place]]
            : maps::SurfaceSample{Eigen::Vector3f::Constant(1e18F), {0.0F, 0.0F, 0.0F}, 1.0F};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      block.point[axis][lane] = sample.point[static_cast<Eigen::Index>(axis)];
      block.normal[axis][lane] = sample.normal[static_cast<Eigen::Index>(axis)];
    }
    if (place >= places_.size()) continue;
    const Eigen::Vector3i& cell = cells[places_[place]];
    Column& column =
        columns_[static_cast<std::size_t>((cell.x() - corner_.x()) * extent_.y() + cell.y() - corner_.y())];
    if (column.cells == 0) {
      column = {cell.z(), 0, static_cast<std::uint32_t>(begins_.size())};
      begins_.push_back(static_cast<std::uint32_t>(place));
    }
    for (; column.cells <= cell.z() - column.low; ++column.cells)
      begins_.push_back(static_cast<std::uint32_t>(place));
    begins_.back() = static_cast<std::uint32_t>(place + 1);
  }
}

PLUMBLINE_CLONES
std::int32_t SurfaceIndex::search(const Eigen::Vector3f& point, const Eigen::Vector3f& normal,
                                  float distance_m, float min_cosine, bool any) const {
  if (samples_.empty()) return -1;
  const Eigen::Vector3i cell = cell_of(point, first_cell_, cell_m_);
  const Eigen::Vector3f below =
      point - (first_cell_ + cell.cast<float>()) * cell_m_;  // from the cell's low corner
  // Of the cells around only such as reach nearer than the best so far.
  constexpr float kRounding_m = 1e-5F;
  float gap_squared[3][3];
  for (int axis = 0; axis < 3; ++axis) {
    const float before = below[axis] - kRounding_m;
    const float behind = cell_m_ - below[axis] - kRounding_m;
    gap_squared[axis][0] = before > 0.0F ? before * before : 0.0F;
    gap_squared[axis][1] = 0.0F;
    gap_squared[axis][2] = behind > 0.0F ? behind * behind : 0.0F;
  }
  const float limit = distance_m * distance_m;
  float least = limit;
  Floats best_squared = Floats{} + limit;
  Ints best_place = Ints{} - 1;
  constexpr Ints kLaneNumbers{0, 1, 2, 3, 4, 5, 6, 7};
  static constexpr std::array<std::array<int, 2>, 9> kAround{
      {{0, 0}, {-1, 0}, {0, -1}, {0, 1}, {1, 0}, {-1, -1}, {-1, 1}, {1, -1}, {1, 1}}};
  for (std::size_t step = 0; step < 10; ++step) {
    // The point's own cell, then the rest of its column, then the columns around.
    const std::array<int, 2>& around = kAround[step < 1 ? 0 : step - 1];
    const float gap_xy = gap_squared[0][around[0] + 1] + gap_squared[1][around[1] + 1];
    if (gap_xy >= least) continue;
    const int x = cell.x() + around[0] - corner_.x();
    const int y = cell.y() + around[1] - corner_.y();
    if (x < 0 || x >= extent_.x() || y < 0 || y >= extent_.y()) continue;
    const Column& column = columns_[static_cast<std::size_t>(x * extent_.y() + y)];
    int from = cell.z() - (step > 0 && gap_xy + gap_squared[2][0] < least ? 1 : 0) - column.low;
    int to = cell.z() + (step > 0 && gap_xy + gap_squared[2][2] < least ? 1 : 0) - column.low;
    if (step == 1 && from == to) continue;
    from = from > 0 ? from : 0;
    to = to < column.cells ? to + 1 : column.cells;
    if (from >= to) continue;
    const std::uint32_t* begins = begins_.data() + column.first;
    if (begins[from] == begins[to]) continue;
    // Whole blocks: the neighbours that come along do no harm.
    const std::size_t last = (begins[to] + kLanes - 1) / kLanes;
    for (std::size_t i = begins[from] / kLanes; i < last; ++i) {
      const auto* lanes = reinterpret_cast<const Floats*>(&blocks_[i]);  // x, y, z of points, then of normals
      const Floats dx = lanes[0] - point.x();
      const Floats dy = lanes[1] - point.y();
      const Floats dz = lanes[2] - point.z();
      const Floats squared = dx * dx + (dy * dy + dz * dz);
      const Floats cosine = lanes[3] * normal.x() + (lanes[4] * normal.y() + lanes[5] * normal.z());
      const Ints better = (squared < best_squared) & (cosine >= min_cosine);
      best_squared = better ? squared : best_squared;
      best_place = better ? kLaneNumbers + static_cast<std::int32_t>(kLanes * i) : best_place;
    }
    for (std::size_t lane = 0; lane < kLanes; ++lane) least = std::min(least, best_squared[lane]);
    if (any && least < limit) break;
  }
  std::int32_t found = -1;
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    if (best_place[lane] < 0 || best_squared[lane] > least) continue;
    if (found < 0 || best_place[lane] < found) found = best_place[lane];
  }
  return found;
}

const maps::SurfaceSample* SurfaceIndex::nearest(const Eigen::Vector3f& point, const Eigen::Vector3f& normal,
                                                 float distance_m, float min_cosine) const {
  const std::int32_t place = search(point, normal, distance_m, min_cosine, false);
  return place < 0 ? nullptr : &samples_[places_[static_cast<std::size_t>(place)]];
}

bool SurfaceIndex::any(const Eigen::Vector3f& point, const Eigen::Vector3f& normal, float distance_m,
                       float min_cosine) const {
  return search(point, normal, distance_m, min_cosine, true) >= 0;
}

}  // namespace plumbline::mapping
