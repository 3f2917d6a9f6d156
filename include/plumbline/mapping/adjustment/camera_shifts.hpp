// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The uncertainty of a camera, carried into the poses of the map that was made with it
// (docs/method/trust.md).
#include <vector>

#include "plumbline/core/executor.hpp"
#include "plumbline/maps/frame_pose.hpp"
#include "plumbline/maps/map.hpp"
#include "plumbline/optimize/camera_calibration.hpp"

namespace plumbline::mapping {

/// Motions (t, w) of a keyframe's camera in its own axes, metres and radians: its pose may be off by the sum
/// of these times independent numbers of variance 1, which are the same for all keyframes.
struct KeyframeShift {
  core::KeyframeId keyframe;
  double stamp = 0.0;  ///< seconds
  std::vector<geometry::Vector6d> motions;
};

/// Shifts of all keyframes of one robot's map. `frames`: its frames; `image`: the pinhole of its images;
/// `camera`: the one that its features were read with; `covariance`: of changes of that. The same for any
/// number of threads.
std::vector<KeyframeShift> camera_shifts(const maps::Map& map, const std::vector<maps::FramePose>& frames,
                                         const sensor::Pinhole& image, const sensor::Camera& camera,
                                         const optimize::CameraCovariance& covariance,
                                         const core::Executor& executor);

}  // namespace plumbline::mapping
