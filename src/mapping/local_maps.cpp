// SPDX-License-Identifier: BSD-3-Clause
// Keyframe clouds made coarse, fused into local maps; which of these overlap.
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "plumbline/cloud/sensor_pose.hpp"
#include "plumbline/cloud/sum_table.hpp"
#include "plumbline/mapping/local_map_alignment.hpp"
#include "plumbline/sensor/depth_noise.hpp"
#include "surface_voxels.hpp"

namespace plumbline::mapping {
namespace {

using core::KeyframeId;
using geometry::Rigid3;

/// Of a voxel and the way its surface faces.
struct VoxelSum {
  std::uint64_t key = 0;
  Eigen::Vector3f point{0, 0, 0};
  Eigen::Vector3f normal{0, 0, 0};
  float weight = 0.0F;
  float count = 0.0F;
};

/// Means of the samples of each voxel and facing, weighted by 1 / sigma^2, in order of voxels. `combined`:
/// the samples are independent measurements, so that their mean is better than each; else it is as good as
/// they are.
CoarseSurface voxel_means(const CoarseSurface& samples, double voxel_m, bool combined) {
  cloud::SumTable<VoxelSum> sums;
  for (const maps::SurfaceSample& s : samples) {
    const std::uint64_t voxel = voxel_key(s.point, static_cast<float>(voxel_m));
    VoxelSum& sum = sums.of(voxel << 3 | facing(s.normal));
    const float w = 1.0F / (s.sigma * s.sigma);
    sum.point += w * s.point;
    sum.normal += w * s.normal;
    sum.weight += w;
    sum.count += 1.0F;
  }
  CoarseSurface means;
  for (const VoxelSum& sum : sums.sorted()) {
    const float sigma = 1.0F / std::sqrt(combined ? sum.weight : sum.weight / sum.count);
    if (sum.normal.norm() > 0.5F * sum.weight)
      means.push_back({sum.point / sum.weight, sum.normal.normalized(), sigma});
  }
  return means;
}

/// Collects the members of one local map after another.
class LocalMapMaker {
 public:
  LocalMapMaker(const maps::Map& map, const std::map<KeyframeId, CoarseSurface>& surfaces,
                const LocalMapOptions& options)
      : map_(map), surfaces_(surfaces), options_(options) {}

  void add(KeyframeId id) {
    if (!members_.empty() && !fits(id)) finish();
    members_.push_back(id);
  }
  void finish() {
    if (members_.empty()) return;
    LocalMap made;
    made.anchor = members_[members_.size() / 2];
    made.members = std::exchange(members_, {});
    CoarseSurface all;
    for (const KeyframeId id : made.members) {
      const Rigid3 anchor_from_member =
          map_.camera_from_world(made.anchor) * map_.camera_from_world(id).inverse();
      const Eigen::Matrix3f rotation = anchor_from_member.rotation.cast<float>();
      const Eigen::Vector3f translation = anchor_from_member.translation.cast<float>();
      for (const maps::SurfaceSample& s : surfaces_.at(id)) {
        all.push_back({rotation * s.point + translation, rotation * s.normal, s.sigma});
      }
    }
    made.surface = voxel_means(all, options_.voxel_m, true);
    result_.push_back(std::move(made));
  }
  [[nodiscard]] std::vector<LocalMap> take() {
    finish();
    return std::move(result_);
  }

 private:
  [[nodiscard]] bool fits(KeyframeId id) const {
    if (id.robot != members_.front().robot) return false;
    if (static_cast<int>(members_.size()) >= options_.keyframes) return false;
    const Rigid3 way = map_.camera_from_world(id) * map_.camera_from_world(members_.front()).inverse();
    return way.translation.norm() <= options_.distance_m &&
           geometry::rotation_angle(way.rotation) <= options_.angle_rad;
  }

  const maps::Map& map_;
  const std::map<KeyframeId, CoarseSurface>& surfaces_;
  const LocalMapOptions& options_;
  std::vector<KeyframeId> members_;
  std::vector<LocalMap> result_;
};

/// Coarse voxels that a local map fills, world, sorted.
std::vector<std::uint64_t> filled_voxels(const maps::Map& map, const LocalMap& local, double voxel_m) {
  const Rigid3 world_from_anchor = map.camera_from_world(local.anchor).inverse();
  const Eigen::Matrix3f rotation = world_from_anchor.rotation.cast<float>();
  const Eigen::Vector3f translation = world_from_anchor.translation.cast<float>();
  std::vector<std::uint64_t> keys;
  keys.reserve(local.surface.size());
  for (const maps::SurfaceSample& s : local.surface) {
    keys.push_back(voxel_key(rotation * s.point + translation, static_cast<float>(voxel_m)) << 3 |
                   facing(rotation * s.normal));
  }
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  return keys;
}

}  // namespace

void LocalMapOptions::declare(core::OptionTable& table) {
  table.integer("local_map.keyframes", keyframes, {1, 1000}, "", "Keyframes in one local map at most");
  table.number("local_map.distance", distance_m, {0.0, 100.0}, "m",
               "A local map ends this far from its first keyframe");
  table.number("local_map.angle", angle_rad, {0.0, 3.2}, "rad", "A local map ends after this turn");
  table.number("local_map.voxel", voxel_m, {0.005, 0.5}, "m", "Voxels of the surfaces that are aligned");
}

void PairOptions::declare(core::OptionTable& table) {
  table.number("pairs.min_overlap", min_overlap, {0.01, 1.0}, "",
               "Share of the smaller local map that both must have seen to be aligned");
  table.integer("pairs.per_map", per_map, {1, 1000}, "", "Alignments of each local map at most");
}

CoarseSurface coarse_surface(const cloud::Cloud& camera_cloud, double voxel_m) {
  CoarseSurface samples;
  samples.reserve(camera_cloud.size());
  const Rigid3 camera_from_depth = cloud::sensor_pose(camera_cloud);
  const Eigen::Matrix3f rotation = camera_from_depth.rotation.cast<float>();
  const Eigen::Vector3f translation = camera_from_depth.translation.cast<float>();
  for (const cloud::Point& p : camera_cloud.points) {
    const Eigen::Vector3f point = p.getVector3fMap();
    const Eigen::Vector3f normal = p.getNormalVector3fMap();
    if (!point.allFinite() || !normal.allFinite() || !(p.z > 0.0F)) continue;
    // Half of the noise stays in the mean of a voxel; it acts along the ray.
    const double sigma = 0.5 * sensor::depth_sigma(static_cast<double>(p.z));
    samples.push_back({rotation * point + translation, rotation * normal,
                       static_cast<float>(sigma) * std::max(0.3F, -normal.z())});
  }
  return voxel_means(samples, voxel_m, false);
}

std::vector<LocalMap> make_local_maps(const maps::Map& map,
                                      const std::map<KeyframeId, CoarseSurface>& surfaces,
                                      const LocalMapOptions& options) {
  LocalMapMaker maker(map, surfaces, options);
  for (const auto& [id, surface] : surfaces) {
    if (map.has_keyframe(id) && !surface.empty()) maker.add(id);
  }
  return maker.take();
}

std::vector<LocalMapPair> overlapping_pairs(const maps::Map& map, const std::vector<LocalMap>& local_maps,
                                            const PairOptions& options) {
  std::vector<std::pair<std::uint64_t, std::uint32_t>> filled;  // voxel, local map
  std::vector<std::size_t> size;
  for (std::size_t i = 0; i < local_maps.size(); ++i) {
    const std::vector<std::uint64_t> keys = filled_voxels(map, local_maps[i], options.voxel_m);
    size.push_back(keys.size());
    for (const std::uint64_t key : keys) filled.emplace_back(key, static_cast<std::uint32_t>(i));
  }
  std::sort(filled.begin(), filled.end());
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::size_t> common;
  for (std::size_t i = 0; i < filled.size(); ++i) {
    for (std::size_t k = i + 1; k < filled.size() && filled[k].first == filled[i].first; ++k) {
      ++common[{filled[i].second, filled[k].second}];
    }
  }
  std::vector<LocalMapPair> candidates;
  for (const auto& [pair, voxels] : common) {
    const double overlap =
        static_cast<double>(voxels) / static_cast<double>(std::min(size[pair.first], size[pair.second]));
    if (overlap >= options.min_overlap) candidates.push_back({pair.first, pair.second, overlap});
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const LocalMapPair& a, const LocalMapPair& b) { return a.overlap > b.overlap; });
  std::vector<int> taken(local_maps.size(), 0);
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
