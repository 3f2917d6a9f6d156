// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "plumbline/core/ids.hpp"
#include "plumbline/geometry/rigid3.hpp"

namespace plumbline::pipeline {

/// The tracker's result for a frame, available as soon as the frame is tracked.
struct LivePose {
  std::size_t frame = 0;  ///< number within the run
  double stamp = 0.0;     ///< seconds
  std::string state;      ///< "tracked", "lost" or "initialising"
  /// In the frame of the first camera, metres; later optimisation moves it, and the results are set upright.
  /// None: not tracked.
  std::optional<geometry::Rigid3> world_from_camera;
  core::KeyframeId keyframe;        ///< valid when the frame became a keyframe
  double sigma_position_m = 0.0;    ///< of each axis, in a finished map; 0: not known
  double sigma_rotation_rad = 0.0;  ///< about each axis, likewise
};

}  // namespace plumbline::pipeline
