// SPDX-License-Identifier: BSD-3-Clause
#include "visits/visit_weld.hpp"

#include <map>
#include <memory>
#include <utility>

namespace plumbline::pipeline {
namespace {

using core::KeyframeId;
using geometry::Rigid3;

constexpr double kNewLoop_m = 0.03;

/// Correction of the keyframe that shares most with `id`, among those that have one; null: it shares nothing.
const Rigid3* correction_beside(const maps::Map& map, KeyframeId id,
                                const std::map<KeyframeId, Rigid3>& corrections) {
  for (const auto& [other, shared] : map.covisible(id, 1)) {
    const auto found = corrections.find(other);
    if (shared > 0 && found != corrections.end()) return &found->second;
  }
  return nullptr;
}

}  // namespace

bool hold_earlier(const maps::Map& earlier, const std::set<std::int32_t>& visitors, MapResult& result) {
  const maps::Map& map = *result.map;
  std::map<KeyframeId, Rigid3> corrections;  // to the earlier world, by keyframe of the earlier map
  mapping::KeyframePoses poses;
  for (const KeyframeId id : map.keyframe_ids()) {
    if (visitors.count(id.robot) != 0 || !earlier.has_keyframe(id)) continue;
    const Rigid3 earlier_from_world = earlier.camera_from_world(id).inverse() * map.camera_from_world(id);
    const Eigen::Vector3d before = earlier.camera_from_world(id).inverse().translation;

    // A loop that the visit closes has corrected the earlier map; its better poses must not be undone.
    if ((before - map.camera_from_world(id).inverse().translation).norm() >= kNewLoop_m) return false;

    corrections[id] = earlier_from_world;
    poses.emplace_back(id, earlier.camera_from_world(id));
  }

  // Keyframes of the visit take the correction of the earlier keyframe beside them, or else that of their
  // predecessor, so that they still fit the earlier map and their path does not jump.
  std::map<std::int32_t, Rigid3> last;  // by visitor
  for (const KeyframeId id : map.keyframe_ids()) {
    if (visitors.count(id.robot) == 0) continue;
    if (const Rigid3* beside = correction_beside(map, id, corrections)) last[id.robot] = *beside;
    poses.emplace_back(id, map.camera_from_world(id) * last[id.robot].inverse());
  }

  auto moved = std::make_shared<maps::Map>(map);
  mapping::move_keyframes(*moved, poses);
  result.map = std::move(moved);
  take_poses_from_map(result);
  return true;
}

}  // namespace plumbline::pipeline
