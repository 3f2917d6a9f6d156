// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/maps/map_join.hpp"

#include <algorithm>
#include <stdexcept>

#include "plumbline/core/hash.hpp"

namespace plumbline::maps {
namespace {

using core::KeyframeId;
using geometry::Rigid3;
using RobotNumbers = std::map<std::int32_t, std::int32_t>;

template <typename IdType>
IdType renamed(IdType id, const RobotNumbers& to) {
  const auto found = id.valid() ? to.find(id.robot) : to.end();
  if (found != to.end()) id.robot = found->second;
  return id;
}

std::vector<Observation> renamed(std::vector<Observation> seen, const RobotNumbers& to) {
  for (Observation& o : seen) o.keyframe = renamed(o.keyframe, to);
  return seen;
}

KeyframeEdge renamed(KeyframeEdge edge, const RobotNumbers& to) {
  edge.a = renamed(edge.a, to);
  edge.b = renamed(edge.b, to);
  return edge;
}

/// Appends a map's parts, moved by `world_from_map`. Its edges are appended to the present ones.
class PartsCollector {
 public:
  void add(const Map& map, const RobotNumbers& to, const Rigid3& world_from_map) {
    const Rigid3 map_from_world = world_from_map.inverse();
    // A map that stays where it is keeps every bit.
    const bool stays = world_from_map.rotation.isIdentity(0.0) && world_from_map.translation.isZero(0.0);

    // Keyframes in the common world, with new robot numbers
    for (const KeyframeId id : map.keyframe_ids()) {
      auto data = std::make_shared<Keyframe>(map.keyframe(id));
      data->id = renamed(id, to);
      data->reference = renamed(data->reference, to);
      parts_.keyframes.push_back(
          {data, stays ? map.camera_from_world(id) : map.camera_from_world(id) * map_from_world,
           renamed(map.parent(id), to)});
    }

    // Landmarks are rotated with their directions
    for (const core::PointId id : map.point_ids()) {
      MapPoint point = map.point(id);
      point.id = renamed(id, to);
      point.position = world_from_map * point.position;
      point.view_direction = world_from_map.rotation * point.view_direction;
      point.normal = world_from_map.rotation * point.normal;

      // Observations refer to renamed keyframes
      point.angle_keyframe = renamed(point.angle_keyframe, to);
      point.observations = renamed(std::move(point.observations), to);
      parts_.points.push_back(std::move(point));
    }

    // Line ends follow the same motion
    for (const core::LineId id : map.line_ids()) {
      MapLine line = map.line(id);
      line.id = renamed(id, to);
      line.start = world_from_map * line.start;
      line.end = world_from_map * line.end;
      line.observations = renamed(std::move(line.observations), to);
      parts_.lines.push_back(std::move(line));
    }

    // Edge numbers continue those of earlier maps
    const std::uint64_t first_edge = parts_.next.edge;
    for (const auto& [order, edge] : map.edges()) {
      parts_.edges.emplace_back(first_edge + order, renamed(edge, to));
    }

    // Loops and next free ids are renamed alike
    for (const LoopEdge& loop : map.loops()) parts_.loops.push_back(renamed(loop, to));
    const NextIds next = map.next_ids();
    for (const KeyframeId id : next.keyframes) parts_.next.keyframes.push_back(renamed(id, to));
    for (const core::PointId id : next.points) parts_.next.points.push_back(renamed(id, to));
    for (const core::LineId id : next.lines) parts_.next.lines.push_back(renamed(id, to));
    parts_.next.edge = first_edge + next.edge;
  }

  /// The joined map; its constructor expects every list in order of ids.
  [[nodiscard]] Map take() {
    const auto by_id = [](const auto& a, const auto& b) { return a.id < b.id; };
    std::sort(parts_.keyframes.begin(), parts_.keyframes.end(),
              [](const auto& a, const auto& b) { return a.data->id < b.data->id; });
    std::sort(parts_.points.begin(), parts_.points.end(), by_id);
    std::sort(parts_.lines.begin(), parts_.lines.end(), by_id);
    std::sort(parts_.next.keyframes.begin(), parts_.next.keyframes.end());
    std::sort(parts_.next.points.begin(), parts_.next.points.end());
    std::sort(parts_.next.lines.begin(), parts_.next.lines.end());
    return Map(std::move(parts_));
  }

 private:
  MapParts parts_;
};

}  // namespace

void renumber(MapParts& parts, const RobotNumbers& to) {
  const auto rename = [&](auto& id) { id = renamed(id, to); };
  const auto rename_seen = [&](auto& landmark) {
    rename(landmark.id);
    for (Observation& o : landmark.observations) rename(o.keyframe);
  };

  // Keyframes are shared with others, so that each gets a new one.
  for (MapParts::KeyframePart& part : parts.keyframes) {
    auto data = std::make_shared<Keyframe>(*part.data);
    rename(data->id);
    rename(data->reference);
    part.data = std::move(data);
    rename(part.parent);
  }

  for (MapPoint& point : parts.points) {
    rename_seen(point);
    rename(point.angle_keyframe);
  }
  for (MapLine& line : parts.lines) rename_seen(line);
  for (auto& [order, edge] : parts.edges) rename(edge);
  for (LoopEdge& loop : parts.loops) rename(loop);
  for (KeyframeId& id : parts.next.keyframes) rename(id);
  for (core::PointId& id : parts.next.points) rename(id);
  for (core::LineId& id : parts.next.lines) rename(id);
}

Map renumbered(const Map& map, const RobotNumbers& to) {
  PartsCollector collector;
  collector.add(map, to, Rigid3{});
  return collector.take();
}

Map joined(const std::vector<const Map*>& maps, const std::vector<Rigid3>& world_from_map) {
  if (maps.size() != world_from_map.size()) throw std::invalid_argument("joined: a pose for each map");
  PartsCollector collector;
  for (std::size_t i = 0; i < maps.size(); ++i) collector.add(*maps[i], {}, world_from_map[i]);
  return collector.take();
}

std::uint64_t content_hash(const Map& map) {
  // Ids are left out: joining changes them
  core::Hash hash;
  for (const KeyframeId id : map.keyframe_ids()) {
    const Keyframe& keyframe = map.keyframe(id);
    hash.number(keyframe.stamp);
    const Rigid3& pose = map.camera_from_world(id);
    hash.bytes(pose.rotation.data(), 9 * sizeof(double));
    hash.bytes(pose.translation.data(), 3 * sizeof(double));
    if (keyframe.features == nullptr) continue;

    // Keypoints and depths
    for (const features::PointFeature& f : keyframe.features->points) {
      hash.number(f.pixel.x());
      hash.number(f.pixel.y());
      hash.number(f.depth);
    }

    // Appearance and lines
    for (const features::Descriptor256& d : keyframe.features->descriptors) hash.bytes(&d, sizeof d);
    for (const features::LineFeature& f : keyframe.features->lines) {
      hash.number(f.segment.start.x());
      hash.number(f.segment.end.y());
    }
  }
  return hash.value();
}

}  // namespace plumbline::maps
