// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What a keyframe costs in memory.
#include <algorithm>
#include <cstddef>

#include "plumbline/maps/map.hpp"

namespace plumbline::tests {

using namespace maps;

template <typename T>
std::size_t bytes(const std::vector<T>& v) {
  return v.capacity() * sizeof(T);
}

inline std::size_t bytes(const cv::Mat& image) { return image.total() * image.elemSize(); }

constexpr std::size_t kGridCells = 3200;  // of the look-up grid at 640 x 480
constexpr std::size_t kTreeNode = 40;     // pointers and colour of a std::map's node, rounded up
constexpr std::size_t kIdSlot = 4;        // what an id costs in an IdMap

template <typename Landmark>
std::size_t part(const Landmark& landmark) {
  const std::size_t whole = sizeof(Landmark) + kIdSlot + bytes(landmark.observations);
  return whole / std::max<std::size_t>(1, landmark.observations.size());
}

struct KeyframeMemory {
  std::size_t features = 0;   ///< corners, lines, descriptors, look-up grid, small pictures
  std::size_t surface = 0;    ///< samples
  std::size_t links = 0;      ///< who sees what, who shares with whom, edges, tree
  std::size_t landmarks = 0;  ///< each divided among the keyframes that see it

  [[nodiscard]] std::size_t total() const { return features + surface + links + landmarks; }
};

/// Bytes on the heap that are there because of keyframe `id`; an estimate that leaves out what the allocator
/// adds.
inline KeyframeMemory memory_of(const Map& map, KeyframeId id) {
  KeyframeMemory memory;
  const Keyframe& keyframe = map.keyframe(id);
  memory.surface = bytes(keyframe.surface);
  if (keyframe.features != nullptr) {
    const features::FrameFeatures& f = *keyframe.features;
    memory.features = sizeof(f) + bytes(f.points) + bytes(f.descriptors) + bytes(f.patches) + bytes(f.lines) +
                      f.points.size() * sizeof(int) + kGridCells + bytes(f.thumbnail) +
                      bytes(f.thumbnail_depth);
  }
  memory.links = sizeof(Keyframe) + bytes(map.points_of(id)) + bytes(map.lines_of(id)) +
                 bytes(map.children(id)) +
                 map.covisible(id, 1).size() * (kTreeNode + sizeof(KeyframeId) + sizeof(int));
  // An edge belongs to both ends.
  memory.links += map.edges_of(id).size() * (kTreeNode + sizeof(SurfaceEdge) + 3 * sizeof(std::uint64_t)) / 2;
  for (PointId p : map.points_of(id)) {
    if (p.valid()) memory.landmarks += part(map.point(p));
  }
  for (LineId l : map.lines_of(id)) {
    if (l.valid()) memory.landmarks += part(map.line(l));
  }
  return memory;
}

}  // namespace plumbline::tests
