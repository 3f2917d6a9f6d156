// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What a keyframe costs in memory.
#include <cstddef>

#include "plumbline/maps/map.hpp"

namespace plumbline::maps {

struct KeyframeMemory {
  std::size_t features = 0;   ///< corners, lines, descriptors, look-up grid, small pictures
  std::size_t surface = 0;    ///< samples
  std::size_t links = 0;      ///< who sees what, who shares with whom, edges, tree
  std::size_t landmarks = 0;  ///< each divided among the keyframes that see it

  [[nodiscard]] std::size_t total() const { return features + surface + links + landmarks; }
};

/// Bytes on the heap that are there because of keyframe `id`; an estimate that leaves out what the allocator
/// adds.
KeyframeMemory memory_of(const Map& map, KeyframeId id);

}  // namespace plumbline::maps
