// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Residuals of the finished map against the observations of its keyframes.
#include <cstddef>
#include <cstdint>
#include <map>

#include "plumbline/maps/map.hpp"
#include "plumbline/sensor/camera.hpp"

namespace plumbline::report {

/// Distances of observations from their landmarks in the map.
struct FamilyFit {
  std::size_t observations = 0;
  double median = 0.0;
  double p90 = 0.0;  ///< nine of ten are nearer
};

struct MapFit {
  FamilyFit points_px;
  FamilyFit depths_mm;  ///< of the points
  FamilyFit lines_px;   ///< both ends, across the line
};

/// Over all observations of landmarks that several keyframes saw. `cameras`: of the robots whose camera is
/// not `camera`.
MapFit fit_of(const maps::Map& map, const sensor::Pinhole& camera,
              const std::map<std::int32_t, sensor::Pinhole>& cameras);

}  // namespace plumbline::report
