// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/maps/components.hpp"

#include <algorithm>
#include <iterator>
#include <map>
#include <set>
#include <utility>

#include "plumbline/maps/map_selection.hpp"

namespace plumbline::maps {
namespace {

using core::KeyframeId;

/// The keyframes of the tree below `root`, itself included.
std::set<KeyframeId> members(const Map& map, KeyframeId root) {
  std::set<KeyframeId> found;
  std::vector<KeyframeId> open{root};
  while (!open.empty()) {
    const KeyframeId id = open.back();
    open.pop_back();
    found.insert(id);
    const std::vector<KeyframeId>& children = map.children(id);
    open.insert(open.end(), children.begin(), children.end());
  }
  return found;
}

/// Landmarks with the members' observations of them; landmarks without any are left out.
template <typename Id, typename Landmark>
void add_landmarks(const Map& map, const std::vector<Id>& ids, const std::set<KeyframeId>& members,
                   std::vector<Landmark>& parts) {
  for (const Id id : ids) {
    Landmark landmark = *map.find(id);
    const auto outside = [&](const Observation& o) { return members.count(o.keyframe) == 0; };
    auto& seen = landmark.observations;
    seen.erase(std::remove_if(seen.begin(), seen.end(), outside), seen.end());
    if (!seen.empty()) parts.push_back(std::move(landmark));
  }
}

/// These keyframes as a map of their own; each is attached to its nearest ancestor among them.
Map selection(const Map& map, const std::set<KeyframeId>& inside) {
  // Parents outside are replaced by member ancestors
  const MapChanges whole = map.changes_since({});
  MapParts parts;
  for (const MapParts::KeyframePart& keyframe : whole.keyframes) {
    if (inside.count(keyframe.data->id) == 0) continue;
    KeyframeId& parent = parts.keyframes.emplace_back(keyframe).parent;
    while (parent.valid() && inside.count(parent) == 0) parent = map.parent(parent);
  }

  // Landmarks lose their observations by outsiders
  add_landmarks(map, map.point_ids(), inside, parts.points);
  add_landmarks(map, map.line_ids(), inside, parts.lines);

  // Only constraints with both ends inside
  const auto between_members = [&](const auto& edge) {
    return inside.count(edge.a) != 0 && inside.count(edge.b) != 0;
  };
  for (const auto& [number, edge] : map.edges()) {
    if (between_members(edge)) parts.edges.emplace_back(number, edge);
  }
  std::copy_if(whole.loops.begin(), whole.loops.end(), std::back_inserter(parts.loops), between_members);

  // Numbers are never given twice
  parts.next = whole.next;
  return Map(std::move(parts));
}

}  // namespace

KeyframeId root_of(const Map& map, KeyframeId keyframe) {
  for (KeyframeId above = map.parent(keyframe); above.valid(); above = map.parent(keyframe)) keyframe = above;
  return keyframe;
}

std::vector<KeyframeId> roots(const Map& map) {
  std::vector<KeyframeId> found = map.keyframe_ids();
  found.erase(
      std::remove_if(found.begin(), found.end(), [&](KeyframeId id) { return map.parent(id).valid(); }),
      found.end());
  return found;
}

Map component(const Map& map, KeyframeId root) { return selection(map, members(map, root)); }

/// The map that remains after removing these keyframes.
Map without(const Map& map, const std::set<KeyframeId>& keyframes) {
  std::set<KeyframeId> inside;
  for (const KeyframeId id : map.keyframe_ids()) {
    if (keyframes.count(id) == 0) inside.insert(id);
  }

  Map result = selection(map, inside);

  // Normals and descriptors change with the observers
  for (const core::PointId id : result.point_ids()) {
    const std::size_t seen = std::as_const(result).point(id).observations.size();
    if (seen != map.point(id).observations.size()) result.refresh_point(id);
  }
  return result;
}

void move_component(Map& map, KeyframeId root, const geometry::Rigid3& new_from_old_world) {
  const std::set<KeyframeId> inside = members(map, root);

  // A landmark belongs to its first observer's component
  const auto is_inside = [&](const auto& landmark) {
    return !landmark.observations.empty() && inside.count(landmark.observations.front().keyframe) != 0;
  };

  // Poses change frame on the world's side
  const geometry::Rigid3 old_from_new_world = new_from_old_world.inverse();
  for (const KeyframeId id : inside) map.set_pose(id, map.camera_from_world(id) * old_from_new_world);

  // Landmarks move with their observers
  for (const core::PointId id : map.point_ids()) {
    if (!is_inside(std::as_const(map).point(id))) continue;
    MapPoint& point = map.point(id);
    point.position = new_from_old_world * point.position;
    point.normal = new_from_old_world.rotation * point.normal;
    point.view_direction = new_from_old_world.rotation * point.view_direction;
  }

  // Lines move with their observers
  for (const core::LineId id : map.line_ids()) {
    if (!is_inside(std::as_const(map).line(id))) continue;
    MapLine& line = map.line(id);
    line.start = new_from_old_world * line.start;
    line.end = new_from_old_world * line.end;
  }
}

void split_component(Map& map, KeyframeId first) {
  // Keyframes of one robot from `first` on
  const KeyframeId root = root_of(map, first);
  if (root == first) return;
  const std::set<KeyframeId> all = members(map, root);
  const auto is_later = [&](KeyframeId id) { return id.robot == first.robot && !(id < first); };

  // Tree: keyframes with a parent on the other side are attached to the new root, or to the old one.
  map.detach(first);
  for (const KeyframeId id : all) {
    const KeyframeId parent = map.parent(id);
    if (id == first || !parent.valid() || is_later(parent) == is_later(id)) continue;
    map.set_parent(id, is_later(id) ? first : root);
  }

  // Landmarks stay with the keyframes that saw them first.
  for (const KeyframeId id : all) {
    if (!is_later(id)) continue;
    const auto is_other = [&](const Observation& o) { return !is_later(o.keyframe); };
    for (const core::PointId point : map.points_seen_by({id})) {
      const auto& seen = std::as_const(map).point(point).observations;
      if (std::any_of(seen.begin(), seen.end(), is_other)) map.unobserve(point, id);
    }

    // The same for lines
    for (const core::LineId line : map.lines_seen_by({id})) {
      const auto& seen = std::as_const(map).line(line).observations;
      if (std::any_of(seen.begin(), seen.end(), is_other)) map.unobserve(line, id);
    }
  }

  // Loops across the split no longer hold
  const auto is_between = [&](const KeyframeEdge& e) { return is_later(e.a) != is_later(e.b); };
  std::vector<LoopEdge> loops = map.loops();
  loops.erase(std::remove_if(loops.begin(), loops.end(), is_between), loops.end());
  map.set_loops(std::move(loops));

  // Constraints across it keep their number, without weight
  const std::map<std::uint64_t, SurfaceEdge> edges = map.edges();
  for (auto [number, edge] : edges) {
    if (!is_between(edge) || all.count(edge.a) == 0) continue;
    edge.information.setZero();
    map.replace_edge(number, edge);
  }
}

std::vector<FramePose> frames_in(const Map& map, std::vector<FramePose> frames) {
  for (FramePose& frame : frames)
    frame.tracked = frame.tracked && frame.reference.valid() && map.has_keyframe(frame.reference);
  return frames;
}

/// The component in which most frames were tracked.
KeyframeId main_root(const Map& map, const std::vector<FramePose>& frames) {
  const std::vector<KeyframeId> all = roots(map);
  if (all.size() == 1) return all.front();

  std::map<KeyframeId, std::size_t> tracked;
  for (const FramePose& frame : frames) {
    if (frame.tracked && map.has_keyframe(frame.reference)) ++tracked[root_of(map, frame.reference)];
  }
  return *std::max_element(all.begin(), all.end(),
                           [&](KeyframeId x, KeyframeId y) { return tracked[x] < tracked[y]; });
}

}  // namespace plumbline::maps
