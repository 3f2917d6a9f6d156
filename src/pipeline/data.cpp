// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/pipeline/data.hpp"

namespace plumbline::pipeline {

void take_poses_from_map(MapResult& result) {
  const maps::Map& map = *result.map;
  result.trajectory = maps::trajectory(result.frame_poses, map);
  result.lines = maps::line_segments(map);
  result.keyframes.clear();
  // Clouds hang on keyframes that have left the map, too.
  for (const core::KeyframeId id : maps::every_keyframe(map)) {
    result.keyframes.push_back({id, map.stamp_of(id), map.pose_of(id).inverse()});
  }
}

}  // namespace plumbline::pipeline
