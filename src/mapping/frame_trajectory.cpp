// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/frame_trajectory.hpp"

#include <cmath>

namespace plumbline::mapping {

using geometry::Rigid3;

maps::FramePose FrameTrajectory::measured(const maps::Map& map, double stamp,
                                          const tracking::TrackResult& track) const {
  maps::FramePose frame;
  frame.stamp = stamp;
  frame.tracked = track.state == tracking::TrackState::kTracked;
  if (!frame.tracked) return frame;
  frame.step_sigma_m = track.sigma_m();
  if (poses_.empty() || !poses_.back().tracked || !track.reference.valid()) return frame;
  const maps::FramePose& last = poses_.back();  // its pose is relative to its keyframe
  frame.camera_from_previous = track.camera_from_world *
                               (last.camera_from_reference * map.camera_from_world(last.reference)).inverse();
  return frame;
}

void FrameTrajectory::record(const maps::Map& map, const maps::FramePose& frame, core::KeyframeId reference,
                             const Rigid3& camera_from_world) {
  poses_.push_back(frame);
  poses_.back().reference = reference;
  poses_.back().camera_from_reference = camera_from_world * map.camera_from_world(reference).inverse();
}

geometry::Vector6d FrameTrajectory::velocity(const maps::Map& map) const {
  if (poses_.size() < 2) return geometry::Vector6d::Zero();
  const maps::FramePose& now = poses_[poses_.size() - 1];
  const maps::FramePose& before = poses_[poses_.size() - 2];
  constexpr double kLongest_s = 0.5;
  const double dt = now.stamp - before.stamp;
  if (!now.tracked || !before.tracked || !(dt > 1e-4 && dt < kLongest_s)) return geometry::Vector6d::Zero();
  const Rigid3 now_from_world = now.camera_from_reference * map.camera_from_world(now.reference);
  const Rigid3 before_from_world = before.camera_from_reference * map.camera_from_world(before.reference);
  return geometry::log_se3(now_from_world * before_from_world.inverse()) / dt;
}

}  // namespace plumbline::mapping
