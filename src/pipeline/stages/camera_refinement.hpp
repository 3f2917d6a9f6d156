// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Whether a robot's camera is what its file says: asked of the robot's own map while it grows and once more
// when it is finished. What is found is used from there on, and the map is made anew for it
// (Slam::recalibrate).
#include <string>

#include "plumbline/core/executor.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/mapping/camera_calibration.hpp"
#include "plumbline/pipeline/data.hpp"
#include "plumbline/pipeline/summary.hpp"

namespace plumbline::pipeline {

/// One robot's camera.
class CameraRefinement {
 public:
  explicit CameraRefinement(const RobotInfo& robot);

  /// Asks the map and the frames of a run that was made with camera(). True: camera() is a better one now.
  bool ask(const maps::Map& map, const std::vector<maps::FramePose>& frames, const core::Executor& executor,
           core::Log& log);

  [[nodiscard]] const sensor::Camera& camera() const { return camera_; }
  /// What was found by all questions so far, against what was given.
  [[nodiscard]] const RunSummary::Camera& report() const { return report_; }
  /// What camera() has from this frame of the run on; 0: from the first one on.
  void used_from(std::size_t frame) { report_.from_frame = frame; }
  /// A run that goes on knows this camera already.
  void restore(const sensor::Camera& camera) { camera_ = camera; }

 private:
  RobotInfo robot_;
  sensor::Camera camera_;
  RunSummary::Camera report_;
};

/// Writes OUT/camera.yaml, of several robots OUT/robots/NAME/camera.yaml. `cameras`: by robot.
core::Result<void> write_cameras(const std::filesystem::path& folder, const std::vector<RobotInfo>& robots,
                                 const std::vector<sensor::Camera>& cameras);

}  // namespace plumbline::pipeline
