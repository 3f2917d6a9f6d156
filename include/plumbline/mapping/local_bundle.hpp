// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Local bundle adjustment (METHOD section 3): a keyframe, what it shares landmarks or surfaces with, and what
// they see. Three steps, so that the middle one can run beside the tracker: take from the map, adjust, put
// back.
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

struct LocalBundleOptions {
  int keyframes = 12;          ///< how many may move
  double max_turn_rate = 0.6;  ///< rad/s; keyframes taken while turning faster are held, and do not speak
  double orb_scale_factor = 1.2;
};

/// Keyframes around those that may move, that see the same landmarks, are held. Without any of these the
/// oldest keyframe is held.
LocalBundle take_local_bundle(const maps::Map& map, core::KeyframeId keyframe, const sensor::Pinhole& camera,
                              const LocalBundleOptions& options);

/// Poses, landmarks and outliers back into the map. Landmarks that only one keyframe sees move with it.
void put_back(const LocalBundle& bundle, maps::Map& map);

}  // namespace plumbline::mapping
