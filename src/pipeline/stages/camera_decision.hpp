// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Whether a run's cameras are what their files say: asked of the run's own maps, and once more of the maps
// made with what was found.
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/core/executor.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/mapping/camera_calibration.hpp"
#include "plumbline/pipeline/robot_recordings.hpp"
#include "plumbline/pipeline/stage.hpp"
#include "plumbline/pipeline/summary.hpp"

namespace plumbline::pipeline {

struct CameraDecision {
  bool made = false;
  int asked = 0;                         ///< times
  bool again = false;                    ///< the run is to begin anew, with `used`
  std::size_t from = 0;                  ///< it goes on, with `used` from this frame on; 0: it does not
  std::vector<sensor::Camera> given;     ///< by robot
  std::vector<sensor::Camera> used;      ///< by robot
  std::vector<RunSummary::Camera> said;  ///< by robot; empty: nobody asked
  std::vector<std::string> news;         ///< by robot, since the last question; empty: nothing better

  /// Asks one robot's map; of all robots in order.
  void ask(const RobotInfo& robot, const mapping::CalibrationRun& run, const core::Executor& executor,
           core::Log& log);
  /// After all were asked, or nobody is to be: says what was found and writes what is used. An error ends the
  /// run: it is to begin again. `live`: it goes on, with what was found from this frame on; 0: without.
  core::Result<void> settle(const RunContext& context, std::optional<std::size_t> live = std::nullopt);
  /// What an interrupted run found for these recordings; nothing changes when it had not, or was given other
  /// cameras.
  void restore(const std::filesystem::path& folder, const RobotRecordings& recordings);
};

/// OUT/camera.yaml, of several robots OUT/robots/NAME/camera.yaml.
core::Result<void> write_cameras(const std::filesystem::path& folder, const RobotRecordings& recordings,
                                 const CameraDecision& decision);

}  // namespace plumbline::pipeline
