// SPDX-License-Identifier: BSD-3-Clause
// The spanning tree: the parent of every keyframe but a root shared much with it.
#include <algorithm>
#include <stdexcept>

#include "plumbline/maps/map.hpp"

namespace plumbline::maps {

void Map::attach(KeyframeId id) {
  const auto near = covisible(id, 1);
  // Only earlier keyframes are candidates: one that already descends from this one would close a cycle.
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
  // A keyframe without children cannot close a longer cycle, so the common case costs nothing.
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

}  // namespace plumbline::maps
