// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/local_mapping/landmark_fusion.hpp"

#include <algorithm>
#include <cmath>

#include "plumbline/sensor/depth_noise.hpp"

namespace plumbline::mapping {
namespace {

using core::KeyframeId;
using core::PointId;

// Strict: the neighbours' poses are known to a fraction of a pixel, and what lies further off is rather
// another corner of the same shape. One wrong observation costs more than ten right ones give.
constexpr double kPixelGate = 1.5;     // squared distance in squared standard deviations
constexpr double kDepthSigmas = 3.0;   // between a landmark and a measured depth, and between landmarks
constexpr double kSamePlace_px = 1.0;  // corners of several octaves at one place are one corner

const features::PointFeature& feature_of(const maps::Map& map, const maps::Observation& o) {
  return map.keyframe(o.keyframe).features->points[static_cast<std::size_t>(o.feature)];
}

/// Landmarks that `from` see and `keyframe` does not; sorted, unique.
std::vector<PointId> unseen_points(const maps::Map& map, const std::vector<KeyframeId>& from,
                                   KeyframeId keyframe) {
  std::vector<PointId> result = map.points_seen_by(from);
  const auto seen = [&](PointId p) { return maps::seen_by(map.point(p).observations, keyframe); };
  result.erase(std::remove_if(result.begin(), result.end(), seen), result.end());
  return result;
}

/// True if the landmark agrees with the feature's measurement.
bool fits(const maps::MapPoint& point, const features::PointFeature& f,
          const geometry::Rigid3& camera_from_world, const sensor::Pinhole& camera, double scale_factor) {
  const Eigen::Vector3d p = camera_from_world * point.position;
  const double sigma = std::pow(scale_factor, f.octave);
  if ((camera.project(p) - f.pixel.cast<double>()).squaredNorm() > kPixelGate * sigma * sigma) return false;
  if (!(f.depth > 0.0F)) return true;
  // The landmark's depth is no more accurate than the measurement.
  const double depth_sigma = std::sqrt(2.0) * sensor::depth_sigma(static_cast<double>(f.depth));
  return std::abs(p.z() - static_cast<double>(f.depth)) < kDepthSigmas * depth_sigma;
}

/// True if no keyframe sees both at different places.
bool may_be_one(const maps::Map& map, const maps::MapPoint& a, const maps::MapPoint& b) {
  for (const maps::Observation& oa : a.observations) {
    for (const maps::Observation& ob : b.observations) {
      if (oa.keyframe != ob.keyframe) continue;
      const Eigen::Vector2f apart = feature_of(map, oa).pixel - feature_of(map, ob).pixel;
      if (static_cast<double>(apart.norm()) > kSamePlace_px) return false;
    }
  }
  return true;
}

/// True if both lie within the depth noise of the camera that sees them.
bool close_together(const maps::MapPoint& a, const maps::MapPoint& b,
                    const geometry::Rigid3& camera_from_world) {
  const double z = (camera_from_world * a.position).z();
  return (a.position - b.position).norm() < kDepthSigmas * std::sqrt(2.0) * sensor::depth_sigma(z);
}

void merge(maps::Map& map, PointId a, PointId b) {
  const std::size_t na = map.point(a).observations.size();
  const std::size_t nb = map.point(b).observations.size();
  const bool keep_a = na != nb ? na > nb : a < b;
  const PointId kept = keep_a ? a : b;
  const PointId gone = keep_a ? b : a;
  const auto wk = static_cast<double>(std::max(na, nb));
  const auto wg = static_cast<double>(std::min(na, nb));
  map.point(kept).position =
      (wk * map.point(kept).position + wg * map.point(gone).position) / std::max(1.0, wk + wg);
  map.merge(kept, gone);
}

void fuse_into(maps::Map& map, const std::vector<PointId>& points, KeyframeId keyframe,
               const sensor::Pinhole& camera, const FusionOptions& options, FusionSummary& summary) {
  const geometry::Rigid3& pose = map.camera_from_world(keyframe);
  const features::FrameFeatures& features = *map.keyframe(keyframe).features;
  const auto matches = tracking::match_points(map, points, {features, camera, pose}, options.radius_px,
                                              options.association, nullptr);

  for (const tracking::PointMatch& m : matches) {
    const maps::MapPoint* point = map.find(m.point);  // an earlier match may have merged it away
    const features::PointFeature& f = features.points[static_cast<std::size_t>(m.feature)];
    if (point == nullptr || maps::seen_by(point->observations, keyframe) ||
        !fits(*point, f, pose, camera, options.association.scale_factor)) {
      continue;
    }

    // A free feature becomes an observation; a feature of another landmark shows that the two may be one.
    const PointId other = map.point_of(keyframe, m.feature);

    if (!other.valid()) {
      map.observe(m.point, keyframe, m.feature);
      map.refresh_point(m.point);
      ++summary.observed;
    } else if (close_together(*point, map.point(other), pose) && may_be_one(map, *point, map.point(other))) {
      merge(map, m.point, other);
      ++summary.merged;
    }
  }
}

/// Focal lengths by robot number; numbers that no robot has get the first camera's.
std::vector<double> focals_of(const std::map<std::int32_t, sensor::Pinhole>& cameras) {
  std::vector<double> focals(static_cast<std::size_t>(cameras.rbegin()->first) + 1,
                             cameras.begin()->second.fx);
  for (const auto& [robot, camera] : cameras) focals[static_cast<std::size_t>(robot)] = camera.fx;
  return focals;
}

}  // namespace

void FusionOptions::declare(core::OptionTable& table) {
  table.integer("fuse.keyframes", keyframes, {1, 50}, "",
                "Number of neighbouring keyframes between which landmarks are compared");
  table.number("fuse.radius", radius_px, {0.5, 50.0}, "px", "Search radius around a landmark's projection");
}

FusionSummary fuse_points(maps::Map& map, KeyframeId keyframe, const std::vector<KeyframeId>& neighbours,
                          const std::map<std::int32_t, sensor::Pinhole>& cameras,
                          const FusionOptions& given) {
  FusionOptions options = given;
  if (cameras.size() > 1) options.association.focals_px = focals_of(cameras);
  FusionSummary summary;
  for (KeyframeId other : neighbours) {
    fuse_into(map, unseen_points(map, {keyframe}, other), other, cameras.at(other.robot), options, summary);
  }
  fuse_into(map, unseen_points(map, neighbours, keyframe), keyframe, cameras.at(keyframe.robot), options,
            summary);
  return summary;
}

}  // namespace plumbline::mapping
