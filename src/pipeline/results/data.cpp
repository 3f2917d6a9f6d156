// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/pipeline/data.hpp"

#include <utility>

#include "plumbline/cloud/compact/compact_cloud.hpp"

namespace plumbline::pipeline {

const char* to_string(FrameState state) {
  constexpr const char* kNames[] = {"initialising", "tracked", "lost", "bridged", "located"};
  return kNames[static_cast<std::size_t>(state)];
}

core::Result<cloud::CloudPtr> cloud_of(const KeyframeCloud& keyframe) {
  if (keyframe.cloud != nullptr) return keyframe.cloud;
  const auto stored = store_cloud_of(keyframe);
  if (!stored) return tl::unexpected(stored.error());
  return cloud::decode_cloud(stored->bytes->data(), stored->bytes->size());
}

core::Result<maps::StoreCloud> store_cloud_of(const KeyframeCloud& keyframe) {
  maps::StoreCloud cloud{keyframe.id, keyframe.frame, keyframe.compact, keyframe.surface};
  if (cloud.bytes != nullptr) return cloud;
  auto bytes = keyframe.stored();
  if (!bytes) return tl::unexpected(bytes.error());
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
  static_cast<maps::MapPoses&>(result) = maps::poses_of(*result.map, result.frame_poses);
  result.accuracy = {};
  result.lines = maps::line_segments(*result.map);
}

}  // namespace plumbline::pipeline
