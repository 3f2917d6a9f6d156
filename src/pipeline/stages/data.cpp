// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/pipeline/data.hpp"

#include <map>
#include <utility>

#include "plumbline/cloud/compact_cloud.hpp"

namespace plumbline::pipeline {

core::Result<cloud::CloudPtr> cloud_of(const KeyframeCloud& keyframe) {
  if (keyframe.cloud != nullptr) return keyframe.cloud;
  const auto stored = store_cloud_of(keyframe);
  if (!stored) return tl::unexpected<core::Error>(stored.error());
  return cloud::decode_cloud(stored->bytes->data(), stored->bytes->size());
}

core::Result<maps::StoreCloud> store_cloud_of(const KeyframeCloud& keyframe) {
  maps::StoreCloud cloud{keyframe.id, keyframe.frame, keyframe.compact, keyframe.surface};
  if (cloud.bytes != nullptr) return cloud;
  auto bytes = keyframe.stored();
  if (!bytes) return tl::unexpected<core::Error>(bytes.error());
  cloud.bytes = std::make_shared<std::vector<std::uint8_t>>(std::move(*bytes));
  return cloud;
}

geometry::Trajectory trajectory_of(const MapResult& map, std::int32_t robot) {
  geometry::Trajectory poses;
  for (std::size_t i = 0; i < map.trajectory.size(); ++i) {
    if (map.trajectory_ids[i].robot == robot) poses.push_back(map.trajectory[i]);
  }
  return poses;
}

void take_poses_from_map(MapResult& result) {
  const maps::Map& map = *result.map;
  result.trajectory = maps::trajectory(result.frame_poses, map);
  result.trajectory_ids.clear();
  std::map<std::int32_t, std::int32_t> frames;  // by robot
  for (const maps::FramePose& frame : result.frame_poses) {
    const std::int32_t number = frames[frame.reference.robot]++;
    if (frame.tracked) result.trajectory_ids.push_back({frame.reference.robot, number});
  }
  result.lines = maps::line_segments(map);
  result.keyframes.clear();
  for (const core::KeyframeId id : map.keyframe_ids()) {
    result.keyframes.push_back({id, map.keyframe(id).stamp, map.camera_from_world(id).inverse()});
  }
}

}  // namespace plumbline::pipeline
