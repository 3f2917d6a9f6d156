// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A robot's way while it is tracked, for somebody who looks on.
#include <cstddef>
#include <optional>

#include "plumbline/mapping/slam.hpp"
#include "plumbline/pipeline/data.hpp"
#include "plumbline/pipeline/observer.hpp"

namespace plumbline::pipeline {

class ObservedWay {
 public:
  /// Tells the observer of a frame of the run, and where the camera is when it was tracked. A component has
  /// no place in the map before it is joined.
  void report(std::size_t frame, const mapping::Slam& slam, const mapping::FrameReport& report,
              TrackedFrame& tracked, RunObserver& observer);

 private:
  core::KeyframeId component_;       ///< the one that is told of
  std::optional<std::size_t> last_;  ///< of the frame poses
  geometry::Rigid3 odometry_from_camera_;
};

}  // namespace plumbline::pipeline
