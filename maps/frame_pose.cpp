// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/maps/frame_pose.hpp"

#include <algorithm>

#include "plumbline/maps/map.hpp"

namespace plumbline::maps {

geometry::Trajectory trajectory(const std::vector<FramePose>& frames, const Map& map) {
  geometry::Trajectory result;
  for (const FramePose& frame : frames) {
    if (!frame.tracked) continue;
    const geometry::Rigid3 camera_from_world = frame.camera_from_reference * map.pose_of(frame.reference);
    result.push_back({frame.stamp, camera_from_world.inverse()});
  }
  return result;
}

geometry::Trajectory keyframe_trajectory(const Map& map) {
  geometry::Trajectory result;
  for (const core::KeyframeId id : every_keyframe(map)) {
    result.push_back({map.stamp_of(id), map.pose_of(id).inverse()});
  }
  return result;
}

std::vector<core::KeyframeId> every_keyframe(const Map& map) {
  const std::vector<core::KeyframeId> live = map.keyframe_ids();
  const std::vector<core::KeyframeId> retired = map.retired_ids();
  std::vector<core::KeyframeId> all(live.size() + retired.size());
  std::merge(live.begin(), live.end(), retired.begin(), retired.end(), all.begin());
  return all;
}

}  // namespace plumbline::maps
