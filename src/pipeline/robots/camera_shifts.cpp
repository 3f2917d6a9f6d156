// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/pipeline/camera_shifts.hpp"

#include "plumbline/mapping/adjustment/camera_shifts.hpp"

namespace plumbline::pipeline {

std::vector<check::CameraShift> camera_shifts(const maps::Map& map,
                                              const std::vector<maps::FramePose>& frames,
                                              const std::vector<maps::RobotInfo>& robots,
                                              const core::Executor& executor) {
  if (robots.size() != 1 || !robots.front().estimate || robots.front().estimate->covariance.isZero(0.0))
    return {};
  const maps::RobotInfo& robot = robots.front();
  const sensor::Camera& camera = robot.versions.empty() ? robot.camera : robot.versions.back().camera;

  std::vector<check::CameraShift> shifts;
  for (auto& shift :
       mapping::camera_shifts(map, frames, robot.camera.color, camera, robot.estimate->covariance, executor))
    shifts.push_back({0, shift.stamp, std::move(shift.motions)});
  return shifts;
}

}  // namespace plumbline::pipeline
