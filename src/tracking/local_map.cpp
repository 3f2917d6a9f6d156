// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/tracking/local_map.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "plumbline/cloud/fusion/cell_map.hpp"
#include "plumbline/maps/components.hpp"

namespace plumbline::tracking {
namespace {

using core::KeyframeId;

/// True if two cameras look the same way and are close together, in units of the scene's depth.
bool overlaps(const geometry::Rigid3& a_from_world, const geometry::Rigid3& b_from_world, double max_angle) {
  const geometry::Rigid3 a_from_b = a_from_world * b_from_world.inverse();
  return a_from_b.rotation(2, 2) > std::cos(max_angle) && a_from_b.translation.norm() < 1.0;
}

void append_unique(std::vector<KeyframeId>& list, KeyframeId id) {
  if (std::find(list.begin(), list.end(), id) == list.end()) list.push_back(id);
}

/// Key of a sample's voxel and direction: fused samples must lie close together and face the same way.
std::uint64_t voxel_of(const WorldSurface& s, double voxel_m) {
  return cloud::pack_cell(cloud::cell_of(s.point / voxel_m)) << 3 |
         static_cast<std::uint64_t>(cloud::facing(s.normal));
}

/// Weighted means of position and normal per voxel; sigma falls with the weight, down to the noise that
/// neighbouring pixels share. In order of first appearance.
std::vector<WorldSurface> fuse_voxels(const std::vector<WorldSurface>& samples, double voxel_m) {
  cloud::CellMap<std::size_t> index;
  index.reserve(samples.size());
  std::vector<WorldSurface> fused;
  std::vector<double> weights;

  // Sums, weighted by inverse variance
  for (const WorldSurface& s : samples) {
    const double w = 1.0 / (s.sigma * s.sigma);
    const auto [found, inserted] = index.try_emplace(voxel_of(s, voxel_m), fused.size());
    if (inserted) {
      fused.push_back({w * s.point, w * s.normal, s.sigma});
      weights.push_back(w);
      continue;
    }

    WorldSurface& f = fused[found->second];
    f.point += w * s.point;
    f.normal += w * s.normal;
    f.sigma = std::min(f.sigma, s.sigma);
    weights[found->second] += w;
  }

  // Means; part of the noise is common to neighbours
  for (std::size_t i = 0; i < fused.size(); ++i) {
    fused[i].point /= weights[i];
    fused[i].normal.normalize();
    fused[i].sigma = std::max(0.6 * fused[i].sigma, 1.0 / std::sqrt(weights[i]));
  }

  return fused;
}

/// Surfaces of the keyframes as one voxel-filtered cloud.
std::vector<WorldSurface> collect_surface(const maps::Map& map, const std::vector<KeyframeId>& keyframes,
                                          double voxel_m) {
  std::vector<WorldSurface> samples;
  std::size_t longest = 0;
  std::vector<geometry::Rigid3> world_from_keyframe;
  for (KeyframeId id : keyframes) {
    longest = std::max(longest, map.keyframe(id).surface.size());
    world_from_keyframe.push_back(map.camera_from_world(id).inverse());
  }

  // The keyframes' samples in turn
  for (std::size_t i = 0; i < longest; ++i) {
    for (std::size_t k = 0; k < keyframes.size(); ++k) {
      const auto& surface = map.keyframe(keyframes[k]).surface;
      if (i >= surface.size()) continue;
      const maps::SurfaceSample& s = surface[i];
      samples.push_back({world_from_keyframe[k] * s.point.cast<double>(),
                         world_from_keyframe[k].rotation * s.normal.cast<double>(),
                         static_cast<double>(s.sigma)});
    }
  }

  return fuse_voxels(samples, voxel_m);
}

}  // namespace

void LocalMapOptions::declare(core::OptionTable& table) {
  table.integer("local.keyframes", keyframes, {1, 200}, "", "Keyframes whose landmarks are tracked");
  table.integer("local.surface_keyframes", surface_keyframes, {1, 50}, "",
                "Keyframes to whose surfaces depth is aligned");
  table.number("local.voxel", voxel_m, {0.001, 1.0}, "m", "Surface samples closer than this are fused");
  table.number("local.overlap_angle", overlap_angle_rad, {0.05, 3.0}, "rad",
               "Keyframes whose optical axes differ less may overlap");
}

LocalMap build_local_map(const maps::Map& map, KeyframeId reference, const LocalMapOptions& options) {
  LocalMap local;
  local.reference = reference;
  local.max_surface_depth_m = options.max_surface_depth_m;
  local.keyframes.push_back(reference);
  const auto wanted = static_cast<std::size_t>(options.keyframes);
  for (const KeyframeId id : map.neighbours(reference, wanted - 1)) append_unique(local.keyframes, id);

  // Poses of other components are in another frame.
  const KeyframeId root = maps::root_of(map, reference);

  // Recent keyframes that may overlap
  const geometry::Rigid3& reference_from_world = map.camera_from_world(reference);
  for (std::int32_t index = reference.index - 1; index >= 0 && index > reference.index - 40; --index) {
    if (local.keyframes.size() >= wanted) break;
    const KeyframeId id{reference.robot, index};
    if (map.has_keyframe(id) &&
        overlaps(map.camera_from_world(id), reference_from_world, options.overlap_angle_rad) &&
        maps::root_of(map, id) == root) {
      append_unique(local.keyframes, id);
    }
  }

  // Landmarks of all, surfaces of overlapping keyframes
  local.points = map.points_seen_by(local.keyframes);
  local.lines = map.lines_seen_by(local.keyframes);
  std::vector<KeyframeId> dense;
  for (KeyframeId id : local.keyframes) {
    if (static_cast<int>(dense.size()) >= options.surface_keyframes) break;
    if (overlaps(map.camera_from_world(id), reference_from_world, options.overlap_angle_rad))
      dense.push_back(id);
  }

  local.surface = collect_surface(map, dense, options.voxel_m);
  return local;
}

}  // namespace plumbline::tracking
