// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Occupancy grid of a map seen from above: occupied, free and unknown cells.
#include <cmath>
#include <cstdint>
#include <vector>

#include "grids/rays.hpp"
#include "source/map_source.hpp"

namespace plumbline::exports {

enum class GridCell : std::uint8_t { kUnknown, kFree, kOccupied };

/// Cell (column, row) covers [x0 + column * resolution, ...) and [y0 + row * resolution, ...); rows go up.
struct Grid {
  double resolution_m = 0.05;
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();  ///< lower left corner; a multiple of the resolution
  int columns = 0;
  int rows = 0;
  std::vector<GridCell> cells;  ///< by row, then column

  [[nodiscard]] GridCell at(int column, int row) const {
    return cells[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
                 static_cast<std::size_t>(column)];
  }
};

/// The range of heights in which things are obstacles, and the floor below it.
struct GridHeights {
  double floor_m = 0.0;
  double low_m = 0.1;
  double high_m = 1.8;

  [[nodiscard]] bool is_obstacle(double z) const { return z >= low_m && z <= high_m; }
  [[nodiscard]] bool is_floor(double z) const {
    constexpr double kBand_m = 0.1;  // how far what is measured of a floor lies from it
    return z < low_m && std::abs(z - floor_m) <= kBand_m;
  }
};

/// Sets the cells of a grid, by the rule of make_grid, from a cloud, the cameras' path and the rays of their
/// views. Errors: those of `views`.
core::Result<void> set_cells(const cloud::CloudFile& cloud, const std::vector<ExportPose>& path,
                             const ForEachView& views, const GridHeights& heights, Grid& grid);

/// Occupied: cells in which something was measured between --heights over the floor, whatever else was seen
/// there. Free: other cells whose floor was seen and above it nothing but air up to 1 m, or nothing but air
/// over the whole of these heights, or where a body that carried the camera had room. Unknown: the rest, such
/// as the inside of a cabinet. Errors: kInput (no free space known, not upright), kUsage (heights, or so fine
/// that the grid would be larger than 2^28 cells).
core::Result<Grid> make_grid(MapSource& source);

}  // namespace plumbline::exports
