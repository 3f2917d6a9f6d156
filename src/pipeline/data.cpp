// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/pipeline/data.hpp"

namespace plumbline::pipeline {

void take_poses_from_map(MapResult& result) {
  const maps::Map& map = *result.map;
  result.trajectory = maps::trajectory(result.frame_poses, map);
  result.lines = maps::line_segments(map);
  result.keyframes.clear();
  for (const core::KeyframeId id : map.keyframe_ids()) {
    result.keyframes.push_back({id, map.keyframe(id).stamp, map.camera_from_world(id).inverse()});
  }
}

}  // namespace plumbline::pipeline
