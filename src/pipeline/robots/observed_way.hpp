// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Path of a robot while it is tracked, for an observer.
#include <cstddef>
#include <optional>

#include "plumbline/mapping/slam.hpp"
#include "plumbline/pipeline/data.hpp"
#include "plumbline/pipeline/observer.hpp"

namespace plumbline::pipeline {

class ObservedWay {
 public:
  /// Reports a frame of the run to the observer, with the camera's pose if it was tracked. A component has no
  /// pose in the map before it is joined.
  void report(std::size_t frame, const mapping::Slam& slam, const mapping::FrameReport& report,
              TrackedFrame& tracked, RunObserver& observer);

 private:
  core::KeyframeId component_;       ///< component that is reported
  std::optional<std::size_t> last_;  ///< index of the latest tracked frame pose
  geometry::Rigid3 odometry_from_camera_;
};

}  // namespace plumbline::pipeline
