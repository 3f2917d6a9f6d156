// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/maps/frame_pose.hpp"

#include "plumbline/maps/map.hpp"

namespace plumbline::maps {

geometry::Trajectory trajectory(const std::vector<FramePose>& frames, const Map& map) {
  geometry::Trajectory result;
  for (const FramePose& frame : frames) {
    if (!frame.tracked) continue;
    const geometry::Rigid3 camera_from_world =
        frame.camera_from_reference * map.camera_from_world(frame.reference);
    result.push_back({frame.stamp, camera_from_world.inverse()});
  }
  return result;
}

geometry::Trajectory keyframe_trajectory(const Map& map) {
  geometry::Trajectory result;
  for (const core::KeyframeId id : map.keyframe_ids()) {
    result.push_back({map.keyframe(id).stamp, map.camera_from_world(id).inverse()});
  }
  return result;
}

}  // namespace plumbline::maps
