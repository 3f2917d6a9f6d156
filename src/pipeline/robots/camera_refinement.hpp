// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Checks a robot's camera against its file: estimated from the robot's own map while it grows, and again when
// it is finished. An improved camera is used from then on, and the map is rebuilt for it (Slam::recalibrate).
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "plumbline/core/executor.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/mapping/camera_calibration.hpp"
#include "plumbline/pipeline/data.hpp"
#include "summary/sections.hpp"

namespace plumbline::pipeline {

/// The estimate of a robot's camera in summary.json.
Json camera_section(const RobotInfo& robot);
/// Pairs of robots whose cameras were estimated, each with whether these may be one: the difference of all
/// numbers against both covariances.
Json camera_pairs(const std::vector<RobotInfo>& robots);

/// One robot's camera.
class CameraRefinement {
 public:
  explicit CameraRefinement(const RobotInfo& robot);

  /// Estimates the camera from the map and frames of a run that was made with camera(). True: camera() was
  /// improved.
  bool ask(const maps::Map& map, const std::vector<maps::FramePose>& frames, const core::Executor& executor,
           core::Log& log);

  [[nodiscard]] const sensor::Camera& camera() const { return known_.better ? known_.found : robot_.camera; }
  /// Result of all estimates so far, relative to the camera that was given.
  [[nodiscard]] const maps::CameraEstimate& known() const { return known_; }
  /// Sets the frame of the run after which the estimate begins; -1: there was none.
  void asked_at(std::int64_t frame) { known_.asked_at = frame; }
  /// Sets the frame of the run from which camera() is used; 0: from the first one on.
  void used_from(std::size_t frame) { known_.used_from = static_cast<std::int64_t>(frame); }
  /// Takes over what the interrupted run knew.
  void restore(const RobotInfo& stored);

 private:
  RobotInfo robot_;
  maps::CameraEstimate known_;
};

/// Writes OUT/camera.yaml, or for several robots OUT/robots/NAME/camera.yaml. `cameras`: by robot.
core::Result<void> write_cameras(const std::filesystem::path& folder, const std::vector<RobotInfo>& robots,
                                 const std::vector<sensor::Camera>& cameras);

}  // namespace plumbline::pipeline
