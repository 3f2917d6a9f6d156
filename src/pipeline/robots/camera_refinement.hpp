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

/// Result of estimating a robot's camera from its own map.
struct CameraReport {
  std::string robot;
  std::vector<mapping::CameraFinding> findings;
  double gain = 0.0;  ///< improvement of the fit on parts of the map that it was not estimated from, share
  std::string note;   ///< why the camera was not estimated; empty: it was
  std::string doubt;  ///< reason not to trust the camera; empty: there is none
  int asked = 0;      ///< number of estimates; the second is of a map made with the result of the first
  std::size_t from_frame = 0;  ///< first frame for which the result is used; 0: all
};
Json section_of(const CameraReport& camera);

/// One robot's camera.
class CameraRefinement {
 public:
  explicit CameraRefinement(const RobotInfo& robot);

  /// Estimates the camera from the map and frames of a run that was made with camera(). True: camera() was
  /// improved.
  bool ask(const maps::Map& map, const std::vector<maps::FramePose>& frames, const core::Executor& executor,
           core::Log& log);

  [[nodiscard]] const sensor::Camera& camera() const { return camera_; }
  /// Findings of all estimates so far, relative to the camera that was given.
  [[nodiscard]] const CameraReport& report() const { return report_; }
  /// Sets the frame of the run from which camera() is used; 0: from the first one on.
  void used_from(std::size_t frame) { report_.from_frame = frame; }
  /// Takes over the camera that the interrupted run had found.
  void restore(const sensor::Camera& camera, std::size_t from_frame);

 private:
  RobotInfo robot_;
  sensor::Camera camera_;
  int views_ = 0;         ///< most views of a question so far
  bool changed_ = false;  ///< it is not the file's any more
  CameraReport report_;
};

/// Writes OUT/camera.yaml, or for several robots OUT/robots/NAME/camera.yaml. `cameras`: by robot.
core::Result<void> write_cameras(const std::filesystem::path& folder, const std::vector<RobotInfo>& robots,
                                 const std::vector<sensor::Camera>& cameras);

}  // namespace plumbline::pipeline
