// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/keyframe_culling.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <unordered_map>

namespace plumbline::mapping {
namespace {

using core::KeyframeId;

const features::FrameFeatures& features_of(const maps::Map& map, KeyframeId id) {
  return *map.keyframe(id).features;
}

int seen_as_sharply(const maps::Map& map, const maps::MapPoint& point, KeyframeId by) {
  const auto octave = [&](const maps::Observation& o) {
    return features_of(map, o.keyframe).points[static_cast<std::size_t>(o.feature)].octave;
  };
  int own = 0;
  for (const maps::Observation& o : point.observations) {
    if (o.keyframe == by) own = octave(o);
  }
  return static_cast<int>(
      std::count_if(point.observations.begin(), point.observations.end(), [&](const maps::Observation& o) {
        return o.keyframe != by && octave(o) <= own + 1;  // neighbouring octaves overlap
      }));
}

int seen_as_long(const maps::Map& map, const maps::MapLine& line, KeyframeId by) {
  const auto length = [&](const maps::Observation& o) {
    return features_of(map, o.keyframe).lines[static_cast<std::size_t>(o.feature)].segment.length();
  };
  float own = 0.0F;
  for (const maps::Observation& o : line.observations) {
    if (o.keyframe == by) own = length(o);
  }
  return static_cast<int>(
      std::count_if(line.observations.begin(), line.observations.end(), [&](const maps::Observation& o) {
        return o.keyframe != by && length(o) >= 0.8F * own;  // ends of lines are seldom exact
      }));
}

std::uint64_t voxel_of(const Eigen::Vector3d& p) {
  constexpr double kVoxel_m = 0.15;
  std::uint64_t key = 0;
  for (int i = 0; i < 3; ++i) {
    const auto cell = static_cast<std::int64_t>(std::floor(p(i) / kVoxel_m));
    key = (key << 21U) | (static_cast<std::uint64_t>(cell) & 0x1FFFFFU);
  }
  return key;
}

/// Those that overlap with it, most first.
std::vector<KeyframeId> neighbours_of(const maps::Map& map, KeyframeId id, int count) {
  std::vector<KeyframeId> result;
  const auto append = [&](KeyframeId other) {
    if (static_cast<int>(result.size()) < count &&
        std::find(result.begin(), result.end(), other) == result.end()) {
      result.push_back(other);
    }
  };
  for (const auto& [other, shared] : map.covisible(id, 15)) append(other);
  for (const maps::SurfaceEdge& edge : map.edges_of(id)) append(edge.a == id ? edge.b : edge.a);
  return result;
}

}  // namespace

void KeyframeCullingOptions::declare(core::OptionTable& table) {
  table.number("redundant.landmarks", redundant_share, {0.0, 1.0}, "",
               "Share of a keyframe's landmarks that others must see for it to go");
  table.number("redundant.surface", covered_share, {0.0, 1.0}, "",
               "Share of a keyframe's surface that others must have measured for it to go");
}

double redundant_landmarks(const maps::Map& map, KeyframeId id, int others) {
  int all = 0;
  int redundant = 0;
  for (core::PointId p : map.points_of(id)) {
    if (!p.valid()) continue;
    ++all;
    redundant += seen_as_sharply(map, map.point(p), id) >= others ? 1 : 0;
  }
  for (core::LineId l : map.lines_of(id)) {
    if (!l.valid()) continue;
    ++all;
    redundant += seen_as_long(map, map.line(l), id) >= others ? 1 : 0;
  }
  return all == 0 ? 1.0 : static_cast<double>(redundant) / all;
}

double covered_surface(const maps::Map& map, KeyframeId id, const std::vector<KeyframeId>& neighbours,
                       int others) {
  const auto& surface = map.keyframe(id).surface;
  if (surface.empty()) return 1.0;
  struct Cover {
    int keyframes = 0;
    KeyframeId last;
  };
  std::unordered_map<std::uint64_t, Cover> cover;  // looked up only: its order shows nowhere
  for (KeyframeId other : neighbours) {
    if (other == id) continue;
    const geometry::Rigid3 world_from_other = map.camera_from_world(other).inverse();
    for (const maps::SurfaceSample& s : map.keyframe(other).surface) {
      Cover& c = cover[voxel_of(world_from_other * s.point.cast<double>())];
      if (c.last != other) ++c.keyframes;
      c.last = other;
    }
  }
  const geometry::Rigid3 world_from_camera = map.camera_from_world(id).inverse();
  const auto covered = std::count_if(surface.begin(), surface.end(), [&](const maps::SurfaceSample& s) {
    const auto found = cover.find(voxel_of(world_from_camera * s.point.cast<double>()));
    return found != cover.end() && found->second.keyframes >= others;
  });
  return static_cast<double>(covered) / static_cast<double>(surface.size());
}

std::vector<KeyframeId> cull_keyframes(maps::Map& map, KeyframeId newest,
                                       const KeyframeCullingOptions& options) {
  std::vector<KeyframeId> gone;
  for (KeyframeId id : neighbours_of(map, newest, options.candidates)) {
    const bool fresh = id.robot == newest.robot && id.index >= newest.index - options.keep_last;
    if (id.index == 0 || id == newest || fresh) continue;
    if (redundant_landmarks(map, id, options.others) < options.redundant_share) continue;
    const std::vector<KeyframeId> around = neighbours_of(map, id, options.candidates);
    // Nothing would speak for it, and nothing against it: it stays.
    if (static_cast<int>(around.size()) < options.others) continue;
    if (covered_surface(map, id, around, options.surface_others) < options.covered_share) continue;
    map.remove_keyframe(id);
    gone.push_back(id);
  }
  return gone;
}

}  // namespace plumbline::mapping
