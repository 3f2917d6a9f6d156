// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/pipeline/data.hpp"

#include <utility>

#include "plumbline/cloud/compact_cloud.hpp"

namespace plumbline::pipeline {

core::Result<cloud::CloudPtr> cloud_of(const KeyframeCloud& keyframe) {
  if (keyframe.cloud != nullptr) return keyframe.cloud;
  if (keyframe.compact != nullptr)
    return cloud::decode_cloud(keyframe.compact->data(), keyframe.compact->size());
  const auto bytes = keyframe.stored();
  if (!bytes) return tl::unexpected<core::Error>(bytes.error());
  return cloud::decode_cloud(bytes->data(), bytes->size());
}

geometry::Trajectory trajectory_of(const MapResult& map, std::int32_t robot) {
  if (map.robots.empty()) return map.trajectory;
  std::vector<maps::FramePose> frames;
  for (const maps::FramePose& frame : map.frame_poses) {
    if (frame.reference.robot == robot) frames.push_back(frame);
  }
  return maps::trajectory(frames, *map.map);
}

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
