// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Occupancy grid of a map seen from above: occupied, free and unknown cells.
#include <cstdint>
#include <vector>

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

/// Occupied: cells with several points of the cloud between --heights over the floor. Free: other cells
/// that two or more camera rays cross at those heights. Errors: kInput (no free space known, not upright),
/// kUsage (heights, or so fine that the grid would be larger than 2^28 cells).
core::Result<Grid> make_grid(MapSource& source);

}  // namespace plumbline::exports
