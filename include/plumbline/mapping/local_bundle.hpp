// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Local bundle adjustment (METHOD section 3): a keyframe, what it shares landmarks or surfaces with, and what they
// see. Three steps, so that the middle one can run beside the tracker: take from the map, adjust, put back.
#include <vector>

#include "plumbline/maps/map.hpp"
#include "plumbline/optimize/bundle_adjustment.hpp"
#include "plumbline/sensor/camera.hpp"

namespace plumbline::mapping {

struct LocalBundle {
  optimize::BundleProblem problem;
  std::vector<core::KeyframeId> keyframes;  ///< of problem.poses
  std::vector<core::PointId> points;
  std::vector<core::LineId> lines;
  struct Seen {
    int landmark = -1;  ///< index into points or lines
    core::KeyframeId keyframe;
  };
  std::vector<Seen> point_seen;  ///< of problem.point_observations
  std::vector<Seen> line_seen;
};

/// `wanted`: how many keyframes may move; those around them that see the same landmarks are held. Without any of
/// these the oldest keyframe is held.
LocalBundle take_local_bundle(const maps::Map& map, core::KeyframeId keyframe, int wanted,
                              const sensor::Pinhole& camera, double orb_scale_factor);

/// Poses, landmarks and outliers back into the map. Landmarks that only one keyframe sees move with it.
void put_back(const LocalBundle& bundle, maps::Map& map);

}  // namespace plumbline::mapping
