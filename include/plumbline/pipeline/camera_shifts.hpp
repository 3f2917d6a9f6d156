// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Effect of an estimated camera's covariance on the poses of its map.
#include <vector>

#include "plumbline/check/self_check.hpp"
#include "plumbline/maps/frame_pose.hpp"
#include "plumbline/maps/map.hpp"
#include "plumbline/maps/store.hpp"

namespace plumbline::pipeline {

/// For CheckInput::camera: of a map of one robot whose camera was estimated; else empty.
std::vector<check::CameraShift> camera_shifts(const maps::Map& map,
                                              const std::vector<maps::FramePose>& frames,
                                              const std::vector<maps::RobotInfo>& robots,
                                              const core::Executor& executor);

}  // namespace plumbline::pipeline
