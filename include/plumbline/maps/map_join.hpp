// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Renumbers the robots of maps, moves maps to other worlds, and joins several as one.
#include <cstdint>
#include <map>
#include <vector>

#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/maps/map.hpp"

namespace plumbline::maps {

/// Hash that depends on what the keyframes measured and on their poses, not on names and robots' numbers.
std::uint64_t content_hash(const Map& map);

/// Gives the robots other numbers, before a map is made of the parts; as renumbered().
void renumber(MapParts& parts, const std::map<std::int32_t, std::int32_t>& to);

/// The same map with other numbers for its robots; robots that are not named in `to` keep theirs.
Map renumbered(const Map& map, const std::map<std::int32_t, std::int32_t>& to);

/// One map of several, whose robots' numbers differ, each moved by its world_from_map.
Map joined(const std::vector<const Map*>& maps, const std::vector<geometry::Rigid3>& world_from_map);

}  // namespace plumbline::maps
