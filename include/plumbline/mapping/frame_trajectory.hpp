// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The path of one robot's camera, frame by frame, each relative to its reference keyframe.
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "plumbline/mapping/adjustment/observation_noise.hpp"
#include "plumbline/maps/frame_pose.hpp"
#include "plumbline/maps/map.hpp"
#include "plumbline/sensor/frame.hpp"
#include "plumbline/sensor/recalibration.hpp"
#include "plumbline/tracking/tracker.hpp"

namespace plumbline::mapping {

class FrameTrajectory {
 public:
  FrameTrajectory() = default;
  explicit FrameTrajectory(std::vector<maps::FramePose> poses) : poses_(std::move(poses)) {}

  /// The tracker's measurement of a frame, in the map that it was tracked in; for record().
  [[nodiscard]] maps::FramePose measured(const maps::Map& map, double stamp,
                                         const tracking::TrackResult& track) const;
  /// True if the pose is accurate enough, by the usual accuracy of the path.
  [[nodiscard]] bool is_accurate(const tracking::TrackResult& track) const;
  /// Landmarks that the next frame saw, for estimating its camera; null: not kept of this one.
  [[nodiscard]] std::shared_ptr<const maps::SeenPoints> seen_points(const tracking::TrackResult& track,
                                                                    const sensor::ImageModel& model,
                                                                    const ObservationNoise& noise) const;
  /// Adds a frame at its pose in the present map.
  void record(const maps::Map& map, const maps::FramePose& frame, core::KeyframeId reference,
              const geometry::Rigid3& camera_from_world);

  /// The motion of camera_from_world between the last two frames, per second; zero when that is not known.
  [[nodiscard]] geometry::Vector6d velocity(const maps::Map& map) const;
  [[nodiscard]] const std::vector<maps::FramePose>& poses() const { return poses_; }

 private:
  [[nodiscard]] double usual_sigma_m() const;

  std::vector<maps::FramePose> poses_;
};

}  // namespace plumbline::mapping
