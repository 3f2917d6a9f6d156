// SPDX-License-Identifier: BSD-3-Clause
// A map from its parts, as stores keep them.
#include <stdexcept>
#include <string>

#include "plumbline/maps/map.hpp"

namespace plumbline::maps {
namespace {

[[noreturn]] void contradiction(const char* what) {
  throw std::invalid_argument(std::string("parts of a map: ") + what);
}

void require(bool holds, const char* otherwise) {
  if (!holds) contradiction(otherwise);
}

/// Inserts landmarks without observations; these are then added one by one, which updates covisibility.
template <typename IdType, typename Landmark>
void restore_landmarks(Map& map, IdMap<IdType, Landmark>& landmarks, std::vector<Landmark>& parts) {
  for (Landmark& part : parts) {
    const IdType id = part.id;
    require(id.valid() && !landmarks.contains(id), "a landmark's id is invalid or there twice");
    const std::vector<Observation> observations = std::move(part.observations);
    part.observations.clear();
    landmarks.insert(id, std::move(part));
    landmarks.at(id).observations.reserve(observations.size());
    for (const Observation& o : observations) {
      require(o.feature >= 0 && map.has_keyframe(o.keyframe), "a landmark is seen by no keyframe");
      require(map.observe(id, o.keyframe, o.feature, o.aligned), "two landmarks are one feature");
    }
  }
}

}  // namespace

NextIds Map::next_ids() const {
  return {keyframes_.next_ids(), points_.next_ids(), lines_.next_ids(), next_edge_};
}

namespace {

/// Pages with a change after the revision `since`, with all their landmarks.
template <typename IdType, typename Landmark>
std::vector<LandmarkPage<Landmark>> touched(const IdMap<IdType, Landmark>& all, std::uint64_t since) {
  constexpr std::int32_t kPage = IdMap<IdType, Landmark>::kIdsPerPage;
  std::vector<LandmarkPage<Landmark>> pages;
  for (const auto& [robot, number] : all.changed_pages(since)) {
    LandmarkPage<Landmark> page{robot, number, {}};
    for (std::int32_t i = number * kPage; i < (number + 1) * kPage; ++i) {
      if (const Landmark* landmark = all.find({robot, i})) page.landmarks.push_back(*landmark);
    }
    pages.push_back(std::move(page));
  }
  return pages;
}

}  // namespace

/// Keyframes always, landmarks and edges since `moment`.
MapChanges Map::changes_since(const MapRevision& moment) const {
  MapChanges changes;
  changes.whole = moment.points == 0 && moment.lines == 0 && moment.edges == 0;
  for (const KeyframeId id : keyframes_.ids()) {
    const KeyframeEntry& entry = keyframes_.at(id);
    changes.keyframes.push_back({entry.data, entry.pose, entry.parent});
  }
  changes.points = touched(points_, moment.points);
  changes.lines = touched(lines_, moment.lines);
  for (const auto& [number, edge] : edges_) changes.edge_names.emplace_back(number, edge.a.robot);
  changes.edges.assign(edges_.lower_bound(moment.edges), edges_.end());
  changes.loops = loops_;
  changes.point_count = points_.size();
  changes.line_count = lines_.size();
  changes.next = next_ids();
  return changes;
}

void Map::restore_tree(const MapParts& parts) {
  for (const MapParts::KeyframePart& part : parts.keyframes) {
    if (!part.parent.valid()) continue;
    require(has_keyframe(part.parent), "a parent is not there");
    set_parent(part.data->id, part.parent);
  }
}

Map::Map(MapParts parts) {
  try {
    // Keyframes first: all else refers to them
    for (const MapParts::KeyframePart& part : parts.keyframes) {
      require(part.data != nullptr && part.data->id.valid() && !has_keyframe(part.data->id),
              "a keyframe's id is invalid or there twice");
      add_keyframe(part.data, part.camera_from_world);
    }

    // Landmarks, then the spanning tree
    restore_landmarks(*this, points_, parts.points);
    restore_landmarks(*this, lines_, parts.lines);
    restore_tree(parts);

    // Edge numbers must increase
    for (const auto& [number, edge] : parts.edges) {
      require(number >= next_edge_, "edges are out of order");
      next_edge_ = number;
      add_edge(edge);
    }

    // Numbers beyond the last edge stay reserved
    require(parts.next.edge >= next_edge_, "an edge's number is too large");
    next_edge_ = parts.next.edge;
    set_loops(std::move(parts.loops));

    // Ids of removed elements are not given again
    for (const KeyframeId next : parts.next.keyframes) keyframes_.reserve(next);
    for (const PointId next : parts.next.points) points_.reserve(next);
    for (const LineId next : parts.next.lines) lines_.reserve(next);
  } catch (const std::out_of_range&) {  // a feature or an end of an edge
    contradiction("something names what is not there");
  }
}

}  // namespace plumbline::maps
