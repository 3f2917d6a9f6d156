// SPDX-License-Identifier: BSD-3-Clause
#include "pages/placing.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "plumbline/evaluate/cloud_fit.hpp"
#include "plumbline/geometry/alignment.hpp"
#include "plumbline/mapping/merging/map_fusion.hpp"
#include "plumbline/maps/map_join.hpp"

namespace plumbline::exports {
namespace {

using geometry::Rigid3;

/// Positions of the second's cameras and of the first's, one pair for each.
struct PosePairs {
  std::vector<Eigen::Vector3d> from, to;

  /// Adds the place of a camera, and the places a metre along each of its axes, so that a straight path tells
  /// a turn about itself as well.
  void add(const Rigid3& second, const Rigid3& first) {
    for (int k = -1; k < 3; ++k) {
      const Eigen::Vector3d way =
          k < 0 ? Eigen::Vector3d(Eigen::Vector3d::Zero()) : Eigen::Vector3d(Eigen::Vector3d::Unit(k));
      from.push_back(second * way);
      to.push_back(first * way);
    }
  }
};

constexpr std::size_t kPlacesOfPose = 4;

/// Root of the mean square distance of the places `from`, moved, to the places `to`; every `step`th of them.
double rms_of(const PosePairs& pairs, const Rigid3& moved, std::size_t step) {
  double sum = 0.0;
  double count = 0.0;
  for (std::size_t i = 0; i < pairs.from.size(); i += step) {
    sum += (moved * pairs.from[i] - pairs.to[i]).squaredNorm();
    count += 1.0;
  }
  return std::sqrt(sum / std::max(1.0, count));
}

/// Root of the mean square distance of the first's cameras from their middle.
double radius_of(const PosePairs& pairs) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double squares = 0.0;
  double count = 0.0;
  for (std::size_t i = 0; i < pairs.to.size(); i += kPlacesOfPose) {
    sum += pairs.to[i];
    squares += pairs.to[i].squaredNorm();
    count += 1.0;
  }
  return std::sqrt(std::max(0.0, squares / count - (sum / count).squaredNorm()));
}

/// Points and normals as evaluate takes them; unknown normals are zero.
evaluate::SurfaceSamples samples_of(const viewer::Points& points) {
  evaluate::SurfaceSamples samples;
  samples.shift = {points.shift[0], points.shift[1], points.shift[2]};
  samples.points.reserve(points.positions.size());
  for (const auto& [x, y, z] : points.positions) samples.points.emplace_back(x, y, z);
  for (const auto& [x, y, z] : points.normals) {
    const Eigen::Vector3f normal(x, y, z);
    samples.normals.push_back(normal.allFinite() ? normal : Eigen::Vector3f::Zero());
  }
  return samples;
}

/// "71 % of the points of B lie at surfaces of A, 2.3 mm off (rms)"
std::string fit_text(const evaluate::CloudFit& fit, const std::string& moved, const std::string& onto) {
  return fmt::format("{:.0f} % of the points of {} lie at surfaces of {}, {:.1f} mm off (rms)",
                     100.0 * fit.overlap, moved, onto, 1000.0 * fit.rmse_m);
}

core::Error apart(const MapSource& one, const MapSource& other, const std::string& why) {
  return {core::ErrorKind::kUntrustworthy,
          fmt::format("{} and {} cannot be aligned: they have no frames in common, and {}; show "
                      "each by itself",
                      one.request().input.string(), other.request().input.string(), why)};
}

/// Places that both maps show.
core::Result<mapping::MergeEvidence> shared_places(const MapSource& one, const MapSource& other) {
  const maps::StoredMap& first = (*one.store("places"))->stored();
  const maps::StoredMap& second = (*other.store("places"))->stored();
  std::vector<mapping::MapPart> parts(2);

  // Robots of both maps need different numbers
  parts[0].map = &first.map;
  std::int32_t free = 0;
  for (const maps::RobotInfo& robot : first.header.robots) {
    parts[0].cameras[robot.number] = robot.camera.color;
    free = std::max(free, robot.number + 1);
  }

  // Robots of the second map follow those of the first
  std::map<std::int32_t, std::int32_t> numbers;
  for (const maps::RobotInfo& robot : second.header.robots) {
    parts[1].cameras[free] = robot.camera.color;
    numbers[robot.number] = free++;
  }
  const maps::Map renumbered = maps::renumbered(second.map, numbers);
  parts[1].map = &renumbered;

  // Overlaps are judged as fuse judges them
  const std::vector<mapping::MergeEvidence> found =
      mapping::find_overlaps(parts, mapping::MapFusionOptions(), one.executor());
  if (found.empty()) return tl::unexpected(apart(one, other, "a map has no keyframes"));
  if (found.front().accepted) return found.front();
  return tl::unexpected(apart(one, other, "as fuse judges, " + found.front().refused));
}

/// Shared places give the second map's pose; ICP may move it no further than the error of such places.
core::Result<Placement> place_by_places(const MapSource& one, const viewer::Points& first,
                                        const MapSource& other, const viewer::Points& second) {
  constexpr double kReach_m = 0.1;
  constexpr double kMost_m = 0.2;
  const auto evidence = shared_places(one, other);
  if (!evidence) return tl::unexpected(evidence.error());

  // ICP begins at the pose that the places give
  const Rigid3 start = one.world_from_map() * evidence->alignment.a_from_b * other.world_from_map().inverse();
  const evaluate::SurfaceSamples moved = samples_of(second);
  const evaluate::CloudFit fit =
      evaluate::fit_cloud(moved, samples_of(first), start, kReach_m, one.executor());

  // The motion of the cloud's middle limits ICP
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3f& p : moved.points) middle += p.cast<double>();
  middle = middle / std::max(1.0, static_cast<double>(moved.points.size())) + moved.shift;
  const bool finer = fit.found && (fit.reference_from_cloud * middle - start * middle).norm() < kMost_m;

  // The page says by which means the maps are aligned
  const std::string how = fmt::format(
      "{} and {} are aligned by places that both show, where {} keyframes agree to {:.0f} mm", first.name,
      second.name, evidence->consistency.agreeing, 1000.0 * evidence->alignment.spread_m);
  if (!finer) return Placement{start, how + "; their surfaces overlap too little to lay them closer"};
  return Placement{fit.reference_from_cloud, how + ", and by ICP: " + fit_text(fit, second.name, first.name)};
}

/// Clouds without a map know no places; they are taken to lie in one frame, roughly.
core::Result<Placement> place_by_icp(const MapSource& one, const viewer::Points& first,
                                     const MapSource& other, const viewer::Points& second) {
  constexpr double kReach_m = 0.3;
  constexpr double kLeastOverlap = 0.3;
  const evaluate::SurfaceSamples a = samples_of(first);
  const evaluate::SurfaceSamples b = samples_of(second);
  const std::string how =
      fmt::format("{} and {} are aligned by ICP from where they lie: ", first.name, second.name);

  const evaluate::CloudFit fit = evaluate::fit_cloud(b, a, Rigid3(), kReach_m, one.executor());
  if (fit.overlap >= kLeastOverlap)
    return Placement{fit.reference_from_cloud, how + fit_text(fit, second.name, first.name)};

  // The first one may be a part of the second.
  const evaluate::CloudFit inverse = evaluate::fit_cloud(a, b, Rigid3(), kReach_m, one.executor());
  if (inverse.overlap >= kLeastOverlap)
    return Placement{inverse.reference_from_cloud.inverse(),
                     how + fit_text(inverse, first.name, second.name)};

  return tl::unexpected(
      apart(one, other,
            fmt::format("only {:.0f} % of the second cloud comes to lie at surfaces of the first by ICP",
                        100.0 * fit.overlap)));
}

}  // namespace

/// The second map's pose by cameras of the same stamps; nothing if there are few or their paths differ.
std::optional<CommonPoses> common_poses(const std::vector<ExportPose>& first,
                                        const std::vector<ExportPose>& second) {
  constexpr double kSame_s = 5e-4;
  constexpr std::size_t kFewest = 3;
  constexpr double kApart_m = 0.1;
  constexpr double kApartOfRadius = 0.2;
  const auto earlier = [](const ExportPose& a, const ExportPose& b) {
    return a.robot != b.robot ? a.robot < b.robot : a.stamp < b.stamp;
  };

  // Cameras with the same stamp
  PosePairs pairs;
  for (const ExportPose& pose : second) {
    ExportPose wanted = pose;
    wanted.stamp -= kSame_s;
    const auto found = std::lower_bound(first.begin(), first.end(), wanted, earlier);
    if (found == first.end() || found->robot != pose.robot || found->stamp > pose.stamp + kSame_s) continue;
    pairs.add(pose.world_from_camera, found->world_from_camera);
  }

  // Least squares over positions and directions
  if (pairs.from.size() < kFewest * kPlacesOfPose) return std::nullopt;
  CommonPoses common;
  common.first_from_second = geometry::align_points(pairs.from, pairs.to);
  common.count = pairs.from.size() / kPlacesOfPose;
  common.rms_m = rms_of(pairs, common.first_from_second, kPlacesOfPose);

  // Larger paths may differ more
  const double most_m = std::max(kApart_m, kApartOfRadius * radius_of(pairs));
  return rms_of(pairs, common.first_from_second, 1) <= most_m ? std::optional(common) : std::nullopt;
}

/// Aligns by common cameras, else by places that both maps show, else by ICP alone.
core::Result<Placement> place_second(const MapSource& one, const viewer::Points& first,
                                     const MapSource& other, const viewer::Points& second, bool by_cameras) {
  const auto poses = one.poses(false);
  const auto other_poses = other.poses(false);
  std::optional<CommonPoses> common;
  if (by_cameras && poses && other_poses) common = common_poses(*poses, *other_poses);

  // Common cameras are the most accurate
  if (common) {
    return Placement{common->first_from_second,
                     fmt::format("{} and {} are aligned by {} cameras of the same time, which lie {:.1f} mm "
                                 "apart (rms)",
                                 first.name, second.name, common->count, 1000.0 * common->rms_m)};
  }
  const bool places = one.has_store() && other.has_store();
  return places ? place_by_places(one, first, other, second) : place_by_icp(one, first, other, second);
}

}  // namespace plumbline::exports
