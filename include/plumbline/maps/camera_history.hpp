// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Clouds and surfaces are stored as they were read; this converts them to the measurements of the latest
// version of their camera (maps::RobotInfo).
#include <map>
#include <utility>
#include <vector>

#include "plumbline/cloud/types.hpp"
#include "plumbline/geometry/velocity.hpp"
#include "plumbline/maps/store.hpp"
#include "plumbline/sensor/recalibration.hpp"

namespace plumbline::maps {

/// Converts a surface sample from the camera before the change to the one after it. `velocity` (m/s, rad/s):
/// of camera_from_world when it was measured, in its own frame.
void recalibrate(const sensor::Recalibration& change, const geometry::Vector6d& velocity,
                 SurfaceSample& sample);

/// Const methods are thread-safe.
class CameraHistory {
 public:
  CameraHistory() = default;
  explicit CameraHistory(const std::vector<RobotInfo>& robots);

  /// True if something of this keyframe or frame was read with an earlier version of the camera.
  [[nodiscard]] bool changes(KeyframeId keyframe) const { return !of(keyframe).empty(); }
  [[nodiscard]] bool changes(FrameId frame) const { return !of(frame).empty(); }
  /// The cloud of a keyframe or of a frame; its sensor pose, too. `velocity`: as in recalibrate().
  void apply(KeyframeId keyframe, const geometry::Vector6d& velocity, cloud::Cloud& cloud) const;
  void apply(FrameId frame, const geometry::Vector6d& velocity, cloud::Cloud& cloud) const;
  void apply(KeyframeId keyframe, const geometry::Vector6d& velocity,
             std::vector<SurfaceSample>& surface) const;

 private:
  struct Change {
    std::int32_t first_keyframe = 0;
    std::int32_t first_frame = 0;
    sensor::Recalibration change;
  };
  using Changes = std::vector<const sensor::Recalibration*>;  ///< one after another
  [[nodiscard]] Changes of(KeyframeId keyframe) const;
  [[nodiscard]] Changes of(FrameId frame) const;
  std::map<std::int32_t, std::vector<Change>> by_robot_;
};

}  // namespace plumbline::maps
