// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/fusion_end.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace plumbline::mapping {
namespace {

using core::KeyframeId;
using geometry::Rigid3;

maps::MapPoint landmark(const maps::KeyframeMessage& message, std::size_t feature,
                        const Eigen::Vector3d& in_camera) {
  const features::FrameFeatures& f = *message.keyframe->features;
  maps::MapPoint point;
  point.position = message.camera_from_world.inverse() * in_camera;
  point.descriptor = f.descriptors[feature];
  point.angle = f.points[feature].angle;
  point.angle_keyframe = message.keyframe->id;
  point.view_direction = (message.camera_from_world.rotation.transpose() * in_camera).normalized();
  point.reference_distance = in_camera.norm();
  point.reference_octave = f.points[feature].octave;
  return point;
}

}  // namespace

FusionEnd::FusionEnd(const MapFusionOptions& options, std::size_t robots, const core::Executor& executor)
    : options_(options),
      executor_(&executor),
      last_(robots),
      points_(robots),
      lines_(robots),
      finder_(options),
      traffic_(robots) {
  for (std::size_t r = 0; r < robots; ++r) {
    maps_.push_back(std::make_unique<maps::Map>());
    parts_.push_back({maps_.back().get(), {}});
  }
}

/// Landmarks get their place from the first keyframe that measured their depth.
void FusionEnd::add(const maps::KeyframeMessage& message) {
  const KeyframeId id = message.keyframe->id;
  const auto robot = static_cast<std::size_t>(id.robot);
  maps::Map& map = *maps_[robot];
  KeyframePoses moved;
  for (const auto& [earlier, pose] : message.moved) {
    if (map.has_keyframe(earlier)) moved.emplace_back(earlier, pose);
  }
  move_keyframes(map, moved);
  parts_[robot].cameras[id.robot] = message.camera;
  map.add_keyframe(message.keyframe, message.camera_from_world);
  const features::FrameFeatures& f = *message.keyframe->features;
  for (std::size_t i = 0; i < f.points.size(); ++i) {
    const std::int32_t number = message.points[i];
    if (number < 0) continue;
    auto known = points_[robot].find(number);
    if (known == points_[robot].end()) {
      if (!(f.points[i].depth > 0.0F)) continue;
      const Eigen::Vector2d pixel = f.points[i].pixel.cast<double>();
      const Eigen::Vector3d in_camera =
          message.camera.unproject(pixel.x(), pixel.y(), static_cast<double>(f.points[i].depth));
      known = points_[robot].emplace(number, map.add_point(id.robot, landmark(message, i, in_camera))).first;
    }
    map.observe(known->second, id, static_cast<int>(i));
  }
  for (std::size_t i = 0; i < f.lines.size(); ++i) {
    const std::int32_t number = message.lines[i];
    if (number < 0) continue;
    auto known = lines_[robot].find(number);
    if (known == lines_[robot].end()) {
      if (!f.lines[i].line3) continue;
      const Rigid3 world_from_camera = message.camera_from_world.inverse();
      maps::MapLine line;
      line.start = world_from_camera * f.lines[i].line3->start;
      line.end = world_from_camera * f.lines[i].line3->end;
      line.descriptor = f.lines[i].descriptor;
      known = lines_[robot].emplace(number, map.add_line(id.robot, line)).first;
    }
    map.observe(known->second, id, static_cast<int>(i));
  }
}

core::Result<std::vector<MergeEvidence>> FusionEnd::receive(const std::vector<std::uint8_t>& bytes) {
  auto message = maps::decode_message(bytes);
  if (!message) return tl::unexpected<core::Error>(message.error());
  const KeyframeId id = message->keyframe->id;
  if (!id.valid() || id.robot < 0 || static_cast<std::size_t>(id.robot) >= maps_.size()) {
    return core::input_error(fmt::format("a keyframe of robot {} came, who is not known here", id.robot));
  }
  const auto robot = static_cast<std::size_t>(id.robot);
  if (maps_[robot]->has_keyframe(id)) {
    return core::input_error(fmt::format("keyframe {} of robot {} came twice", id.index, id.robot));
  }
  Traffic& traffic = traffic_[robot];
  ++traffic.messages;
  traffic.bytes += bytes.size();
  traffic.most = std::max(traffic.most, bytes.size());
  add(*message);
  const auto candidates = finder_.look(parts_, robot, id, last_[robot]);
  finder_.add(*maps_[robot], id);
  last_[robot] = id;

  std::vector<VerifiedPair> tried(candidates.size());
  executor_->parallel_for(candidates.size(), [&](std::size_t i) {
    tried[i] = verify_candidate(parts_, candidates[i], options_);
  });
  std::vector<MergeEvidence> certain;
  for (std::size_t i = 0; i < tried.size(); ++i) {
    if (!tried[i].evidence.accepted) continue;
    const std::pair<std::size_t, std::size_t> parts{std::min(robot, candidates[i].match_part),
                                                    std::max(robot, candidates[i].match_part)};
    std::vector<VerifiedPair>& pairs = verified_[parts];
    pairs.push_back(tried[i]);
    if (merged_[parts] || static_cast<int>(pairs.size()) < options_.few_pairs) continue;
    MergeEvidence merge = decide_overlap(parts_, parts.first, parts.second, pairs, options_, *executor_);
    if (!merge.accepted) continue;
    merged_[parts] = true;
    certain.push_back(std::move(merge));
  }
  return certain;
}

}  // namespace plumbline::mapping
