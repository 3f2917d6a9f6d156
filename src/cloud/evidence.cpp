// SPDX-License-Identifier: BSD-3-Clause
#include "evidence.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "plumbline/core/clones.hpp"
#include "plumbline/sensor/depth_noise.hpp"

namespace plumbline::cloud {
namespace {

constexpr float kSigmas = 3.0F;
constexpr float kPose_m = 0.03F;  // poses are not exact
constexpr int kFewestCells = 7;   // of 3 x 3
constexpr std::size_t kBlock = 256;

/// Limits of cells, given how many around them were measured, the nearest and the furthest of these,
/// millimetres.
PLUMBLINE_CLONES void limits_of(const std::uint16_t* cells, const std::uint16_t* nearest,
                                const std::uint16_t* furthest, std::size_t count,
                                DepthRaster::Limits* limits) {
  for (std::size_t i = 0; i < count; ++i) {
    const auto near_mm = static_cast<std::int32_t>(nearest[i]),
               far_mm = static_cast<std::int32_t>(furthest[i]);
    const double near_sigma = sensor::depth_sigma(0.001 * static_cast<double>(near_mm));
    const double far_sigma = sensor::depth_sigma(0.001 * static_cast<double>(far_mm));
    const float near_margin = 1000.0F * (kSigmas * static_cast<float>(near_sigma) + kPose_m);
    const float far_margin = 1000.0F * (kSigmas * static_cast<float>(far_sigma) + kPose_m);
    const float free_to = static_cast<float>(near_mm) - near_margin;
    const float hidden_from = static_cast<float>(far_mm) + far_margin;
    const float low = free_to < 1.0F ? 1.0F : free_to > 65535.0F ? 65535.0F : free_to;
    const float high = hidden_from < 1.0F ? 1.0F : hidden_from > 65535.0F ? 65535.0F : hidden_from;
    const bool enough = cells[i] >= kFewestCells;
    limits[i].free_to = static_cast<std::uint16_t>(enough ? static_cast<std::int32_t>(low) : 0);
    limits[i].hidden_from = static_cast<std::uint16_t>(enough ? static_cast<std::int32_t>(high) : 0);
  }
}

/// Of each column of three rows: cells that were measured, the nearest and the furthest.
PLUMBLINE_CLONES void of_columns(const std::uint16_t* above, const std::uint16_t* middle,
                                 const std::uint16_t* below, std::size_t count, std::uint16_t* cells,
                                 std::uint16_t* nearest, std::uint16_t* furthest) {
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint16_t a = above[i], b = middle[i], c = below[i];
    cells[i] = static_cast<std::uint16_t>((a != 0 ? 1 : 0) + (b != 0 ? 1 : 0) + (c != 0 ? 1 : 0));
    // No measurement is further than any: 0 less 1 is the largest number.
    const auto before = [](std::uint16_t depth) { return static_cast<std::uint16_t>(depth - 1); };
    nearest[i] = static_cast<std::uint16_t>(std::min({before(a), before(b), before(c)}) + 1);
    furthest[i] = std::max({a, b, c});
  }
}

/// Of each three neighbouring columns.
PLUMBLINE_CLONES void of_threes(std::size_t count, const std::uint16_t* cells, const std::uint16_t* nearest,
                                const std::uint16_t* furthest, std::uint16_t* all_cells,
                                std::uint16_t* all_nearest, std::uint16_t* all_furthest) {
  const auto before = [](std::uint16_t depth) { return static_cast<std::uint16_t>(depth - 1); };
  for (std::size_t i = 0; i < count; ++i) {
    all_cells[i] = static_cast<std::uint16_t>(cells[i] + cells[i + 1] + cells[i + 2]);
    all_nearest[i] = static_cast<std::uint16_t>(
        std::min({before(nearest[i]), before(nearest[i + 1]), before(nearest[i + 2])}) + 1);
    all_furthest[i] = std::max({furthest[i], furthest[i + 1], furthest[i + 2]});
  }
}

/// The limits of row `j`, all but its first and last cell.
struct RowLimits {
  explicit RowLimits(int width) : size(static_cast<std::size_t>(width)) {
    for (auto* row : {&cells, &nearest, &furthest, &all_cells, &all_nearest, &all_furthest})
      row->resize(size);
  }
  void find(const DepthRaster& raster, int j, std::size_t first, std::size_t count,
            DepthRaster::Limits* limits) {
    const std::uint16_t* row = raster.nearest.data() + static_cast<std::size_t>(j) * size + first - 1;
    of_columns(row - size, row, row + size, count + 2, cells.data(), nearest.data(), furthest.data());
    of_threes(count, cells.data(), nearest.data(), furthest.data(), all_cells.data(), all_nearest.data(),
              all_furthest.data());
    limits_of(all_cells.data(), all_nearest.data(), all_furthest.data(), count, limits);
  }

  std::size_t size;
  std::vector<std::uint16_t> cells, nearest, furthest, all_cells, all_nearest, all_furthest;
};

/// Of the 3 x 3 cells around (i, j), which all lie within the raster.
DepthRaster::Limits limits_around(const DepthRaster& raster, std::size_t cell) {
  const auto width = static_cast<std::size_t>(raster.width);
  std::array<std::uint16_t, 3> cells{}, nearest{}, furthest{};
  std::array<std::uint16_t, 1> all_cells{}, all_nearest{}, all_furthest{};
  const std::uint16_t* row = raster.nearest.data() + cell - 1;
  of_columns(row - width, row, row + width, 3, cells.data(), nearest.data(), furthest.data());
  of_threes(1, cells.data(), nearest.data(), furthest.data(), all_cells.data(), all_nearest.data(),
            all_furthest.data());
  DepthRaster::Limits limits;
  limits_of(all_cells.data(), all_nearest.data(), all_furthest.data(), 1, &limits);
  return limits;
}

/// Which cell of the raster each place lies in, -1: none that could say anything; and how far away,
/// millimetres.
PLUMBLINE_CLONES void project(const float* x, const float* y, const float* z, std::size_t count,
                              const Asking::Projection& p, std::int32_t* cell, float* z_mm) {
  constexpr float kCells_per_px = 1.0F / static_cast<float>(DepthRaster::kCell_px);
  const float* r = p.rotation;
  const float* t = p.translation;
  for (std::size_t i = 0; i < count; ++i) {
    const float at_x = r[0] * x[i] + (r[1] * y[i] + r[2] * z[i]) + t[0];
    const float at_y = r[3] * x[i] + (r[4] * y[i] + r[5] * z[i]) + t[1];
    const float at_z = r[6] * x[i] + (r[7] * y[i] + r[8] * z[i]) + t[2];
    const float per_m = 1.0F / at_z;
    const float u = p.fx * at_x * per_m + p.cx;
    const float v = p.fy * at_y * per_m + p.cy;
    const float column = u * kCells_per_px;
    const float row = v * kCells_per_px;
    const bool inside = (at_z > 0.05F) & (at_z <= p.furthest_m) & (column >= 1.0F) & (row >= 1.0F) &
                        (column < p.last_column) & (row < p.last_row);
    const auto i_cell = static_cast<std::int32_t>(inside ? column : 0.0F);
    const auto j_cell = static_cast<std::int32_t>(inside ? row : 0.0F);
    cell[i] = inside ? j_cell * p.width + i_cell : -1;
    z_mm[i] = 1000.0F * at_z;
  }
}

}  // namespace

void set_limits(DepthRaster& raster) {
  raster.limits.assign(raster.nearest.size(), {});
  if (raster.width < 3) return;
  RowLimits limits(raster.width);
  const auto width = static_cast<std::size_t>(raster.width);
  for (int j = 1; j + 1 < raster.height; ++j)
    limits.find(raster, j, 1, width - 2, raster.limits.data() + static_cast<std::size_t>(j) * width + 1);
}

Asking::Asking(const DepthRaster& raster, const Eigen::Matrix3f& camera_from_world,
               const Eigen::Vector3f& translation)
    : raster_(raster), projection_{} {
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column)
      projection_.rotation[3 * row + column] = camera_from_world(row, column);
    projection_.translation[row] = translation[row];
  }
  projection_.fx = static_cast<float>(raster.camera.fx);
  projection_.fy = static_cast<float>(raster.camera.fy);
  projection_.cx = static_cast<float>(raster.camera.cx);
  projection_.cy = static_cast<float>(raster.camera.cy);
  projection_.furthest_m = raster.furthest_m + 0.5F;
  projection_.last_column = static_cast<float>(raster.width - 1);
  projection_.last_row = static_cast<float>(raster.height - 1);
  projection_.width = raster.width;
}

void Asking::ask(const float* x, const float* y, const float* z, std::size_t count, Evidence* found) const {
  std::array<std::int32_t, kBlock> cells;
  std::array<float, kBlock> z_mm;
  for (std::size_t first = 0; first < count; first += kBlock) {
    const std::size_t some = std::min(kBlock, count - first);
    project(x + first, y + first, z + first, some, projection_, cells.data(), z_mm.data());
    for (std::size_t i = 0; i < some; ++i) {
      Evidence& one = found[first + i];
      one = Evidence::kNone;
      if (cells[i] < 0) continue;
      const auto cell = static_cast<std::size_t>(cells[i]);
      const DepthRaster::Limits limits =
          raster_.limits.empty() ? limits_around(raster_, cell) : raster_.limits[cell];
      if (limits.free_to == 0) continue;
      one = z_mm[i] < static_cast<float>(limits.free_to)       ? Evidence::kFree
            : z_mm[i] > static_cast<float>(limits.hidden_from) ? Evidence::kHidden
                                                               : Evidence::kSurface;
    }
  }
}

Evidence evidence(const DepthRaster& raster, const Eigen::Vector3f& point) {
  Evidence found = Evidence::kNone;
  const Asking asking(raster, Eigen::Matrix3f::Identity(), Eigen::Vector3f::Zero());
  asking.ask(&point.x(), &point.y(), &point.z(), 1, &found);
  return found;
}

}  // namespace plumbline::cloud
