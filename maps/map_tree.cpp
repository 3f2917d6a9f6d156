// SPDX-License-Identifier: BSD-3-Clause
// Keyframes that leave the map, and the spanning tree that says what takes their place.
#include <algorithm>
#include <stdexcept>

#include "plumbline/maps/map.hpp"

namespace plumbline::maps {

geometry::Rigid3 Map::pose_of(KeyframeId id) const {
  if (const KeyframeEntry* entry = keyframes_.find(id); entry != nullptr) return entry->pose;
  const RetiredKeyframe& gone = retired_.at(id);
  return gone.camera_from_heir * keyframes_.at(gone.heir).pose;
}

double Map::stamp_of(KeyframeId id) const {
  const KeyframeEntry* entry = keyframes_.find(id);
  return entry != nullptr ? entry->data->stamp : retired_.at(id).stamp;
}

void Map::attach(KeyframeId id) {
  const auto near = covisible(id, 1);
  // Only what was there before: a keyframe that already hangs on this one would close a cycle.
  for (const auto& [other, shared] : near) {
    if (other.robot != id.robot || other < id) {
      set_parent(id, other);
      return;
    }
  }
  for (KeyframeId before{id.robot, id.index - 1}; before.valid(); --before.index) {
    if (has_keyframe(before)) {
      set_parent(id, before);
      return;
    }
  }
}

void Map::set_parent(KeyframeId child, KeyframeId parent) {
  KeyframeEntry& entry = keyframes_.at(child);
  KeyframeEntry& above = keyframes_.at(parent);
  // A keyframe on which nothing hangs can close no longer cycle: the common case costs nothing.
  bool cycle = child == parent;
  for (KeyframeId k = parent; !entry.children.empty() && k.valid(); k = keyframes_.at(k).parent) {
    cycle = cycle || k == child;
  }
  if (cycle) throw std::invalid_argument("set_parent: the parent hangs on the child");
  detach(child);
  entry.parent = parent;
  above.children.insert(std::lower_bound(above.children.begin(), above.children.end(), child), child);
}

void Map::detach(KeyframeId child) {
  KeyframeEntry& entry = keyframes_.at(child);
  if (!entry.parent.valid()) return;
  std::vector<KeyframeId>& siblings = keyframes_.at(entry.parent).children;
  siblings.erase(std::lower_bound(siblings.begin(), siblings.end(), child));
  entry.parent = {};
}

/// The children of `id` find new parents: in turn the one that shares most with the parent, or with a sister
/// that has been placed already. Returns who takes the place of `id`; invalid: nobody is there.
KeyframeId Map::leave_tree(KeyframeId id) {
  std::vector<KeyframeId> orphans = keyframes_.at(id).children;
  const KeyframeId parent = keyframes_.at(id).parent;
  std::vector<KeyframeId> placed;
  for (KeyframeId orphan : orphans) detach(orphan);
  detach(id);
  if (parent.valid()) {
    placed.push_back(parent);
  } else if (!orphans.empty()) {
    placed.push_back(orphans.front());
    orphans.erase(orphans.begin());
  }
  const KeyframeId heir = placed.empty() ? KeyframeId{} : placed.front();
  while (!orphans.empty()) {
    std::size_t best = 0;
    KeyframeId best_parent = placed.front();
    int most = -1;
    for (std::size_t i = 0; i < orphans.size(); ++i) {
      for (KeyframeId candidate : placed) {
        if (const int shared = this->shared(orphans[i], candidate); shared > most) {
          most = shared;
          best = i;
          best_parent = candidate;
        }
      }
    }
    set_parent(orphans[best], best_parent);
    placed.push_back(orphans[best]);
    orphans.erase(orphans.begin() + static_cast<std::ptrdiff_t>(best));
  }
  return heir;
}

void Map::forget_observations(KeyframeId id) {
  const std::vector<PointId> points = keyframes_.at(id).points;
  for (PointId p : points) {
    if (!p.valid()) continue;
    unobserve(p, id);
    if (points_.at(p).observations.empty()) {
      points_.erase(p);
    } else {
      refresh_point(p);  // its angle may have been measured in this picture
    }
  }
  const std::vector<LineId> lines = keyframes_.at(id).lines;
  for (LineId l : lines) {
    if (!l.valid()) continue;
    unobserve(l, id);
    if (lines_.at(l).observations.empty()) lines_.erase(l);
  }
}

void Map::forget_edges(KeyframeId id) {
  const std::vector<std::uint64_t> edges = keyframes_.at(id).edges;
  for (std::uint64_t i : edges) {
    const SurfaceEdge& edge = edges_.at(i);
    std::vector<std::uint64_t>& others = keyframes_.at(edge.a == id ? edge.b : edge.a).edges;
    others.erase(std::find(others.begin(), others.end(), i));
    edges_.erase(i);
  }
  keyframes_.at(id).edges.clear();
  const auto at_it = [id](const LoopEdge& loop) { return loop.a == id || loop.b == id; };
  loops_.erase(std::remove_if(loops_.begin(), loops_.end(), at_it), loops_.end());
}

void Map::remove_keyframe(KeyframeId id) {
  if (!has_keyframe(id)) throw std::out_of_range("remove_keyframe: no such keyframe");
  if (keyframes_.size() == 1) throw std::invalid_argument("remove_keyframe: it is the only one");
  KeyframeId heir = leave_tree(id);
  if (!heir.valid()) {  // it stood alone
    const std::vector<KeyframeId> all = keyframes_.ids();
    heir = all[0] == id ? all[1] : all[0];
  }
  forget_observations(id);
  forget_edges(id);
  const KeyframeEntry gone = keyframes_.at(id);
  keyframes_.erase(id);
  KeyframeEntry& entry = keyframes_.at(heir);
  const geometry::Rigid3 gone_from_heir = gone.pose * entry.pose.inverse();
  for (KeyframeId earlier : gone.retired) {
    RetiredKeyframe& r = retired_.at(earlier);
    r = {r.stamp, heir, r.camera_from_heir * gone_from_heir};
    entry.retired.push_back(earlier);
  }
  retired_.insert(id, {gone.data->stamp, heir, gone_from_heir});
  entry.retired.push_back(id);
}

}  // namespace plumbline::maps
