// SPDX-License-Identifier: BSD-3-Clause
// Keyframe clouds made coarse, fused into local maps; which of these overlap.
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "plumbline/cloud/fusion/cell_map.hpp"
#include "plumbline/cloud/registration/surface_cloud.hpp"
#include "plumbline/cloud/sensor_pose.hpp"
#include "plumbline/mapping/registration/local_map_alignment.hpp"
#include "plumbline/sensor/depth_noise.hpp"

namespace plumbline::mapping {
namespace {

using core::KeyframeId;
using geometry::Rigid3;

/// Collects the members of one local map after another.
class LocalMapCutter {
 public:
  LocalMapCutter(const maps::Map& map, const LocalMapOptions& options) : map_(map), options_(options) {}

  void add(KeyframeId id) {
    if (!members_.empty() && !fits(id)) finish();
    members_.push_back(id);
  }
  [[nodiscard]] std::vector<LocalMap> take() {
    finish();
    return std::move(result_);
  }

 private:
  void finish() {
    if (members_.empty()) return;
    LocalMap made;
    made.anchor = members_[members_.size() / 2];
    made.members = std::exchange(members_, {});
    result_.push_back(std::move(made));
  }
  [[nodiscard]] bool fits(KeyframeId id) const {
    if (id.robot != members_.front().robot) return false;
    if (static_cast<int>(members_.size()) >= options_.keyframes) return false;
    const Rigid3 way = map_.camera_from_world(id) * map_.camera_from_world(members_.front()).inverse();
    return way.translation.norm() <= options_.distance_m &&
           geometry::rotation_angle(way.rotation) <= options_.angle_rad;
  }

  const maps::Map& map_;
  const LocalMapOptions& options_;
  std::vector<KeyframeId> members_;
  std::vector<LocalMap> result_;
};

CoarseSurface samples_of(const cloud::SurfaceCloud& cloud) {
  CoarseSurface samples;
  samples.reserve(cloud.size());
  for (const cloud::SurfacePoint& p : cloud) {
    samples.push_back({p.getVector3fMap(), p.getNormalVector3fMap(), p.curvature});
  }
  return samples;
}

/// Surface of the members of a local map, in its anchor's frame.
CoarseSurface fused_surface(const maps::Map& map, const std::map<KeyframeId, CoarseSurface>& surfaces,
                            const LocalMap& local, double voxel_m) {
  cloud::SurfaceCloud all;
  for (const KeyframeId id : local.members) {
    const Rigid3 anchor_from_member =
        map.camera_from_world(local.anchor) * map.camera_from_world(id).inverse();
    const Eigen::Matrix3f rotation = anchor_from_member.rotation.cast<float>();
    const Eigen::Vector3f translation = anchor_from_member.translation.cast<float>();
    for (const maps::SurfaceSample& s : surfaces.at(id))
      all.push_back(cloud::surface_point(rotation * s.point + translation, rotation * s.normal, s.sigma));
  }
  return samples_of(cloud::voxel_filtered(all, static_cast<float>(voxel_m), true));
}

/// Coarse voxels that a local map fills, world, sorted.
std::vector<std::uint64_t> filled_voxels(const maps::Map& map, const LocalMap& local, double voxel_m) {
  const Rigid3 world_from_anchor = map.camera_from_world(local.anchor).inverse();
  const Eigen::Matrix3f rotation = world_from_anchor.rotation.cast<float>();
  const Eigen::Vector3f translation = world_from_anchor.translation.cast<float>();
  std::vector<std::uint64_t> keys;
  for (const maps::SurfaceSample& s : local.surface) {
    const Eigen::Vector3f at = (rotation * s.point + translation) / static_cast<float>(voxel_m);
    const std::uint64_t key = cloud::pack_cell(at.array().floor().cast<int>()) << 3 |
                              static_cast<std::uint64_t>(cloud::facing(Eigen::Vector3f(rotation * s.normal)));
    if (keys.empty() || keys.back() != key) keys.push_back(key);  // neighbours follow one another
  }
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  return keys;
}

struct Common {
  std::uint32_t a;
  std::uint32_t b;
  std::uint32_t voxels;
};

/// Numbers of voxels that local maps have in common; a < b, sorted by a, then b.
std::vector<Common> common_voxels(const std::vector<std::vector<std::uint64_t>>& keys,
                                  const core::Executor& executor) {
  // Sorted by voxel, all local maps that share a voxel stand next to one another.
  std::vector<std::pair<std::uint64_t, std::uint32_t>> filled;  // voxel, local map
  for (std::size_t i = 0; i < keys.size(); ++i) {
    for (const std::uint64_t key : keys[i]) filled.emplace_back(key, static_cast<std::uint32_t>(i));
  }

  std::sort(filled.begin(), filled.end());
  std::vector<std::vector<std::size_t>> places(keys.size());  // of each local map in `filled`
  for (std::size_t i = 0; i < filled.size(); ++i) places[filled[i].second].push_back(i);

  std::vector<std::vector<Common>> found(keys.size());

  // Each local map counts only later ones, so that every pair is counted once and
  // each thread has a list of its own.
  executor.parallel_for(keys.size(), [&](std::size_t a) {
    std::vector<std::uint32_t> voxels(keys.size(), 0);
    for (const std::size_t i : places[a]) {
      for (std::size_t k = i + 1; k < filled.size() && filled[k].first == filled[i].first; ++k) {
        ++voxels[filled[k].second];
      }
    }

    for (std::size_t b = a + 1; b < keys.size(); ++b) {
      if (voxels[b] > 0)
        found[a].push_back({static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b), voxels[b]});
    }
  });

  std::vector<Common> result;
  for (const std::vector<Common>& some : found) result.insert(result.end(), some.begin(), some.end());
  return result;
}

}  // namespace

void LocalMapOptions::declare(core::OptionTable& table) {
  table.integer("local_map.keyframes", keyframes, {1, 1000}, "",
                "Largest number of keyframes in a local map");
  table.number("local_map.distance", distance_m, {0.0, 100.0}, "m",
               "Largest distance of a local map's keyframes from its first");
  table.number("local_map.angle", angle_rad, {0.0, 3.2}, "rad", "A local map ends after this turn");
  table.number("local_map.voxel", voxel_m, {0.005, 0.5}, "m", "Voxel size of the surfaces to align");
}

void PairOptions::declare(core::OptionTable& table) {
  table.number("pairs.min_overlap", min_overlap, {0.01, 1.0}, "",
               "Smallest share of the smaller local map that both have seen");
  table.integer("pairs.per_map", per_map, {1, 1000}, "", "Largest number of alignments of each local map");
}

CoarseSurface coarse_surface(const cloud::Cloud& camera_cloud, double voxel_m) {
  const Rigid3 camera_from_depth = cloud::sensor_pose(camera_cloud);
  const Eigen::Matrix3f rotation = camera_from_depth.rotation.cast<float>();
  const Eigen::Vector3f translation = camera_from_depth.translation.cast<float>();
  cloud::SurfaceCloud points;
  for (const cloud::Point& p : camera_cloud.points) {
    const Eigen::Vector3f normal = p.getNormalVector3fMap();
    if (!p.getVector3fMap().allFinite() || !normal.allFinite() || !(p.z > 0.0F)) continue;
    // Half of the noise stays in the mean of a voxel; it acts along the ray.
    const double sigma = 0.5 * sensor::depth_sigma(static_cast<double>(p.z));
    points.push_back(cloud::surface_point(rotation * p.getVector3fMap() + translation, rotation * normal,
                                          static_cast<float>(sigma) * std::max(0.3F, -normal.z())));
  }
  return samples_of(cloud::voxel_filtered(points, static_cast<float>(voxel_m), false));
}

std::vector<LocalMap> make_local_maps(const maps::Map& map,
                                      const std::map<core::KeyframeId, CoarseSurface>& surfaces,
                                      const LocalMapOptions& options, const core::Executor& executor) {
  LocalMapCutter cutter(map, options);
  for (const auto& [id, surface] : surfaces) {
    if (map.has_keyframe(id) && !surface.empty()) cutter.add(id);
  }
  std::vector<LocalMap> local_maps = cutter.take();
  executor.parallel_for(local_maps.size(), [&](std::size_t i) {
    local_maps[i].surface = fused_surface(map, surfaces, local_maps[i], options.voxel_m);
  });
  return local_maps;
}

std::vector<LocalMapPair> overlapping_pairs(const maps::Map& map, const std::vector<LocalMap>& local_maps,
                                            const PairOptions& options, const core::Executor& executor) {
  std::vector<std::vector<std::uint64_t>> keys(local_maps.size());
  executor.parallel_for(local_maps.size(),
                        [&](std::size_t i) { keys[i] = filled_voxels(map, local_maps[i], options.voxel_m); });

  // The overlap is a share of the smaller local map: a small one inside a large one overlaps completely.
  std::vector<LocalMapPair> candidates;
  for (const auto& [a, b, voxels] : common_voxels(keys, executor)) {
    const double overlap =
        static_cast<double>(voxels) / static_cast<double>(std::min(keys[a].size(), keys[b].size()));
    if (overlap >= options.min_overlap) candidates.push_back({a, b, overlap});
  }

  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const LocalMapPair& a, const LocalMapPair& b) { return a.overlap > b.overlap; });
  std::vector<int> taken(local_maps.size(), 0);

  // A pair is left out only if both have enough partners, so that a local map
  // with few overlaps keeps them all.
  std::vector<LocalMapPair> pairs;
  for (const LocalMapPair& pair : candidates) {
    if (taken[pair.a] >= options.per_map && taken[pair.b] >= options.per_map) continue;
    ++taken[pair.a];
    ++taken[pair.b];
    pairs.push_back(pair);
  }

  std::sort(pairs.begin(), pairs.end(), [](const LocalMapPair& a, const LocalMapPair& b) {
    return std::pair(a.a, a.b) < std::pair(b.a, b.b);
  });

  return pairs;
}

}  // namespace plumbline::mapping
