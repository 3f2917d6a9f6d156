// SPDX-License-Identifier: BSD-3-Clause
#include "robots/observed_way.hpp"

namespace plumbline::pipeline {

void ObservedWay::report(std::size_t number, const mapping::Slam& slam, const mapping::FrameReport& report,
                         TrackedFrame& tracked, RunObserver& observer) {
  const auto pose_of = [&](const maps::FramePose& frame) {
    return (frame.camera_from_reference * slam.map().camera_from_world(frame.reference)).inverse();
  };
  LivePose live{number, tracked.stamp, to_string(tracked.row.state), std::nullopt, tracked.keyframe};
  const bool is_tracked = tracked.pose && tracked.pose->tracked;
  if (is_tracked) live.world_from_camera = pose_of(*tracked.pose);
  observer.processed(live);
  if (!is_tracked) return;
  if (!component_.valid()) component_ = report.component;
  if (report.component != component_) return;

  // Both ends of a step are in the present map, so that a motion of the map in between does not count.
  const geometry::Rigid3 map_from_camera = *live.world_from_camera;
  odometry_from_camera_ =
      last_ ? odometry_from_camera_ * (pose_of(slam.frame_poses()[*last_]).inverse() * map_from_camera)
            : map_from_camera;
  last_ = slam.frame_poses().size() - 1;

  tracked.map_from_camera = map_from_camera;
  observer.tracked(tracked.robot, tracked.stamp, map_from_camera, odometry_from_camera_);
  if (tracked.keyframe.valid()) observer.keyframes(tracked.robot, maps::keyframe_trajectory(slam.map()));
}

}  // namespace plumbline::pipeline
