// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A bundle of a map's keyframes and landmarks, a few or all, and the way back into the map.
#include <vector>

#include "plumbline/maps/map.hpp"
#include "plumbline/optimize/bundle_adjustment.hpp"

namespace plumbline::mapping {

struct MapBundle {
  optimize::BundleProblem problem;
  std::vector<core::KeyframeId> keyframes;    ///< of problem.poses
  std::vector<core::PointId> points;          ///< of problem.points
  std::vector<core::LineId> lines;            ///< of problem.lines
  std::vector<maps::Observation> point_seen;  ///< of problem.point_observations
  std::vector<maps::Observation> line_seen;   ///< of problem.line_observations
};

/// Moves points and lines to their adjusted positions, if they are still in the map.
void put_back_landmarks(const MapBundle& bundle, maps::Map& map);

/// Observations that did not fit go, unless the feature is another landmark's by now; with their last one
/// landmarks go.
void drop_outliers(const MapBundle& bundle, maps::Map& map);

}  // namespace plumbline::mapping
