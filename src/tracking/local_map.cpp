// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/tracking/local_map.hpp"

#include <algorithm>
#include <cmath>

namespace plumbline::tracking {
namespace {

using core::KeyframeId;

/// Looking the same way: angle between the optical axes, and how far apart in units of the scene's depth.
bool overlaps(const geometry::Rigid3& a_from_world, const geometry::Rigid3& b_from_world, double max_angle) {
  const geometry::Rigid3 a_from_b = a_from_world * b_from_world.inverse();
  return a_from_b.rotation(2, 2) > std::cos(max_angle) && a_from_b.translation.norm() < 1.0;
}

void append_unique(std::vector<KeyframeId>& list, KeyframeId id) {
  if (std::find(list.begin(), list.end(), id) == list.end()) list.push_back(id);
}

std::vector<WorldSurface> collect_surface(const maps::Map& map, const std::vector<KeyframeId>& keyframes) {
  std::vector<WorldSurface> result;
  std::size_t longest = 0;
  std::vector<geometry::Rigid3> world_from_keyframe;
  for (KeyframeId id : keyframes) {
    longest = std::max(longest, map.keyframe(id).surface.size());
    world_from_keyframe.push_back(map.camera_from_world(id).inverse());
  }
  for (std::size_t i = 0; i < longest; ++i) {
    for (std::size_t k = 0; k < keyframes.size(); ++k) {
      const auto& surface = map.keyframe(keyframes[k]).surface;
      if (i >= surface.size()) continue;
      const maps::SurfaceSample& s = surface[i];
      result.push_back({world_from_keyframe[k] * s.point.cast<double>(),
                        world_from_keyframe[k].rotation * s.normal.cast<double>(), static_cast<double>(s.sigma)});
    }
  }
  return result;
}

}  // namespace

void LocalMapOptions::declare(core::OptionTable& table) {
  table.integer("local.keyframes", keyframes, {1, 200}, "", "Keyframes whose landmarks are tracked");
  table.integer("local.surface_keyframes", surface_keyframes, {1, 50}, "", "Keyframes whose surfaces are aligned to");
  table.number("local.overlap_angle", overlap_angle_rad, {0.05, 3.0}, "rad",
               "Keyframes whose optical axes differ less may overlap");
}

LocalMap build_local_map(const maps::Map& map, KeyframeId reference, const LocalMapOptions& options) {
  LocalMap local;
  local.reference = reference;
  local.keyframes.push_back(reference);
  const auto wanted = static_cast<std::size_t>(options.keyframes);
  for (const auto& [id, shared] : map.covisible(reference, 15)) {
    if (local.keyframes.size() >= wanted) break;
    append_unique(local.keyframes, id);
  }
  const geometry::Rigid3& reference_from_world = map.camera_from_world(reference);
  for (std::int32_t index = reference.index - 1; index >= 0 && index > reference.index - 40; --index) {
    if (local.keyframes.size() >= wanted) break;
    const KeyframeId id{reference.robot, index};
    if (map.has_keyframe(id) && overlaps(map.camera_from_world(id), reference_from_world, options.overlap_angle_rad)) {
      append_unique(local.keyframes, id);
    }
  }
  for (KeyframeId id : local.keyframes) {
    for (core::PointId p : map.points_of(id)) {
      if (p.valid()) local.points.push_back(p);
    }
    for (core::LineId l : map.lines_of(id)) {
      if (l.valid()) local.lines.push_back(l);
    }
  }
  const auto sort_unique = [](auto& ids) {
    std::sort(ids.begin(), ids.end());
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  };
  sort_unique(local.points);
  sort_unique(local.lines);

  std::vector<KeyframeId> dense;
  for (KeyframeId id : local.keyframes) {
    if (static_cast<int>(dense.size()) >= options.surface_keyframes) break;
    if (overlaps(map.camera_from_world(id), reference_from_world, options.overlap_angle_rad)) dense.push_back(id);
  }
  local.surface = collect_surface(map, dense);
  return local;
}

}  // namespace plumbline::tracking
