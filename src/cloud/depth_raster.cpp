// SPDX-License-Identifier: BSD-3-Clause
// The small depth picture of a view.
#include <algorithm>
#include <array>
#include <cmath>

#include "plumbline/cloud/free_space.hpp"
#include "plumbline/core/clones.hpp"

namespace plumbline::cloud {
namespace {

constexpr std::size_t kBlock = 256;

struct Cells {
  std::array<std::int32_t, kBlock> column, row;  ///< -1: outside of the picture, or no measurement
  std::array<std::int32_t, kBlock> depth_mm;
};

struct Projection {
  float fx, fy, cx, cy;
  std::int32_t width, height;
};

PLUMBLINE_CLONES void project(const float* x, const float* y, const float* z, std::size_t count,
                              const Projection& camera, Cells& to) {
  constexpr float kMost = 1e6F;
  for (std::size_t i = 0; i < count; ++i) {
    const bool measured =
        (z[i] > 0.0F) & (z[i] < 65.0F) & (std::abs(x[i]) < INFINITY) & (std::abs(y[i]) < INFINITY);
    const float column = camera.fx * x[i] / z[i] + camera.cx + 0.5F;
    const float row = camera.fy * y[i] / z[i] + camera.cy + 0.5F;
    const bool inside = measured & (column >= 0.0F) & (row >= 0.0F);
    const float u = inside & (column < kMost) ? column : kMost;
    const float v = inside & (row < kMost) ? row : kMost;
    const auto whole_u = static_cast<std::int32_t>(u), whole_v = static_cast<std::int32_t>(v);
    const bool seen = (whole_u < camera.width) & (whole_v < camera.height);
    to.column[i] = seen ? whole_u : -1;
    to.row[i] = whole_v;
    // Rounded, halves up: a float and a half are exact in double precision.
    const double mm = static_cast<double>(1000.0F * (measured ? z[i] : 0.0F)) + 0.5;
    const auto whole = static_cast<std::int32_t>(mm);
    to.depth_mm[i] = whole > 1 ? whole : 1;
  }
}

}  // namespace

DepthRaster depth_raster(const ViewPoints& points, const sensor::Pinhole& camera) {
  constexpr int kCell = DepthRaster::kCell_px;
  DepthRaster raster;
  raster.camera = camera;
  raster.width = (camera.width + kCell - 1) / kCell;
  raster.height = (camera.height + kCell - 1) / kCell;
  raster.nearest.assign(static_cast<std::size_t>(raster.width) * static_cast<std::size_t>(raster.height), 0);
  const Projection projection{static_cast<float>(camera.fx),
                              static_cast<float>(camera.fy),
                              static_cast<float>(camera.cx),
                              static_cast<float>(camera.cy),
                              camera.width,
                              camera.height};
  Cells cells;
  for (std::size_t first = 0; first < points.size(); first += kBlock) {
    const std::size_t count = std::min(kBlock, points.size() - first);
    project(points.x.data() + first, points.y.data() + first, points.z.data() + first, count, projection,
            cells);
    for (std::size_t i = 0; i < count; ++i) {
      if (cells.column[i] < 0) continue;
      std::uint16_t& cell = raster.nearest[static_cast<std::size_t>(cells.row[i] / kCell * raster.width +
                                                                    cells.column[i] / kCell)];
      const auto depth = static_cast<std::uint16_t>(cells.depth_mm[i]);
      if (cell == 0 || depth < cell) cell = depth;
      raster.furthest_m = std::max(raster.furthest_m, points.z[first + i]);
    }
  }
  return raster;
}

DepthRaster depth_raster(const Cloud& camera_cloud, const sensor::Pinhole& camera) {
  ViewPoints points;
  take_points(camera_cloud, points);
  return depth_raster(points, camera);
}

}  // namespace plumbline::cloud
