// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A place in a projected coordinate system, by PROJ.
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"

namespace plumbline::exports {

struct GridPlace {
  int epsg = 0;  ///< 0: a site's own grid
  std::string name;
  double east = 0.0, north = 0.0;  ///< metres
  double turn =
      0.0;  ///< from east to true north or, of a datum, to the map's x axis; radians, counter-clockwise
  double scale = 1.0;  ///< grid metres a true metre
};

/// EPSG:`epsg` at a position: its convergence and scale. Errors (kUsage): unknown, not covered.
core::Result<GridPlace> grid_at(int epsg, double east, double north);

/// The UTM zone of latitude, longitude, heading of x (degrees) and, ignored here, height. Errors (kUsage).
core::Result<GridPlace> grid_of(const std::vector<double>& datum);

}  // namespace plumbline::exports
