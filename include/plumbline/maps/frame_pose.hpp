// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Poses of frames that are not keyframes: kept relative to a keyframe, so that they move with it.
#include <vector>

#include "plumbline/core/ids.hpp"
#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/geometry/trajectory.hpp"

namespace plumbline::maps {

class Map;

struct FramePose {
  double stamp = 0.0;  ///< seconds
  core::KeyframeId reference;
  geometry::Rigid3 camera_from_reference;
  bool tracked = false;
};

/// World poses of the tracked frames, in the order given, as their keyframes lie in `map` now.
geometry::Trajectory trajectory(const std::vector<FramePose>& frames, const Map& map);

/// World poses of the keyframes, by id.
geometry::Trajectory keyframe_trajectory(const Map& map);

}  // namespace plumbline::maps
