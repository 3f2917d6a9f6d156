// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "plumbline/mapping/local_mapping/landmark_fusion.hpp"
#include "plumbline/sensor/depth_noise.hpp"

namespace plumbline::mapping {
namespace {

using core::KeyframeId;
using core::LineId;

// Strict, because parallel edges a finger apart are two, and one wrong merge does more harm than ten right
// ones do good.
constexpr double kEnd_px = 1.0;       // of a measured end from the landmark's image
constexpr double kEndSigmas = 3.0;    // of a measured end from the landmark in space
constexpr double kMaxAngle = 0.07;    // rad, between two landmarks that are one
constexpr double kMinSigma_m = 0.01;  // ends of lines are less exact than corners

std::vector<LineId> unseen_lines(const maps::Map& map, const std::vector<KeyframeId>& from,
                                 KeyframeId keyframe) {
  std::vector<LineId> result = map.lines_seen_by(from);
  const auto seen = [&](LineId l) { return maps::seen_by(map.line(l).observations, keyframe); };
  result.erase(std::remove_if(result.begin(), result.end(), seen), result.end());
  return result;
}

double distance(const Eigen::Vector3d& p, const maps::MapLine& line) {
  return (p - geometry::nearest_point(geometry::line_through(line.start, line.end), p)).norm();
}

/// True if both measured ends lie on the landmark, in the image and in space.
bool fits(const maps::MapLine& line, const features::LineFeature& f,
          const geometry::Rigid3& camera_from_world, const sensor::Pinhole& camera) {
  const geometry::PluckerLine in_camera =
      geometry::transform(camera_from_world, geometry::line_through(line.start, line.end));
  const Eigen::Vector3d image =
      geometry::line_projection(camera.fx, camera.fy, camera.cx, camera.cy) * in_camera.n;
  const double norm = image.head<2>().norm();
  if (!(norm > 1e-9)) return false;
  for (const Eigen::Vector2f& end : {f.segment.start, f.segment.end}) {
    if (std::abs(image.dot(end.cast<double>().homogeneous())) > kEnd_px * norm) return false;
  }
  if (!f.line3) return true;
  for (const Eigen::Vector3d& end : {f.line3->start, f.line3->end}) {
    const double sigma = std::max(kMinSigma_m, std::sqrt(2.0) * sensor::depth_sigma(end.z()));
    if ((end - geometry::nearest_point(in_camera, end)).norm() > kEndSigmas * sigma) return false;
  }
  return true;
}

/// True if the landmark agrees with all keyframes of the other one: two edges may coincide in one image by
/// chance.
bool fits_all(const maps::Map& map, const maps::MapLine& line, const maps::MapLine& other,
              const std::map<std::int32_t, sensor::Pinhole>& cameras) {
  return std::all_of(other.observations.begin(), other.observations.end(), [&](const maps::Observation& o) {
    const features::LineFeature& f =
        map.keyframe(o.keyframe).features->lines[static_cast<std::size_t>(o.feature)];
    return fits(line, f, map.camera_from_world(o.keyframe), cameras.at(o.keyframe.robot));
  });
}

/// True if they have the same direction, each end of the shorter lies on the longer within the noise at its
/// depth, and no keyframe sees them as two.
bool may_be_one(const maps::MapLine& a, const maps::MapLine& b, const geometry::Rigid3& camera_from_world) {
  const Eigen::Vector3d da = (a.end - a.start).normalized();
  const Eigen::Vector3d db = (b.end - b.start).normalized();
  if (!(da.dot(db) > std::cos(kMaxAngle))) return false;
  const bool a_longer = (a.end - a.start).squaredNorm() > (b.end - b.start).squaredNorm();
  const maps::MapLine& longer = a_longer ? a : b;
  const maps::MapLine& shorter = a_longer ? b : a;
  for (const Eigen::Vector3d& end : {shorter.start, shorter.end}) {
    const double z = (camera_from_world * end).z();
    const double sigma = std::max(kMinSigma_m, std::sqrt(2.0) * sensor::depth_sigma(z));
    if (distance(end, longer) > kEndSigmas * sigma) return false;
  }
  return std::none_of(a.observations.begin(), a.observations.end(),
                      [&](const maps::Observation& o) { return maps::seen_by(b.observations, o.keyframe); });
}

/// Extends `line` so that it covers `other`, too.
void extend(maps::MapLine& line, const maps::MapLine& other) {
  const Eigen::Vector3d direction = (line.end - line.start).normalized();
  double low = 0.0;
  double high = (line.end - line.start).norm();
  for (const Eigen::Vector3d& end : {other.start, other.end}) {
    const double along = direction.dot(end - line.start);
    low = std::min(low, along);
    high = std::max(high, along);
  }
  const Eigen::Vector3d origin = line.start;
  line.start = origin + low * direction;
  line.end = origin + high * direction;
}

void merge(maps::Map& map, LineId a, LineId b) {
  const std::size_t na = map.line(a).observations.size();
  const std::size_t nb = map.line(b).observations.size();
  const bool keep_a = na != nb ? na > nb : a < b;
  const LineId kept = keep_a ? a : b;
  const LineId gone = keep_a ? b : a;
  extend(map.line(kept), map.line(gone));
  map.merge(kept, gone);
}

void fuse_into(maps::Map& map, const std::vector<LineId>& lines, KeyframeId keyframe,
               const std::map<std::int32_t, sensor::Pinhole>& cameras, const FusionOptions& options,
               FusionSummary& summary) {
  const sensor::Pinhole& camera = cameras.at(keyframe.robot);
  const geometry::Rigid3& pose = map.camera_from_world(keyframe);
  const features::FrameFeatures& features = *map.keyframe(keyframe).features;
  const auto matches = tracking::match_lines(map, lines, {features, camera, pose}, options.radius_px,
                                             options.association, nullptr);

  for (const tracking::LineMatch& m : matches) {
    const maps::MapLine* line = map.find(m.line);  // an earlier match may have merged it away
    if (line == nullptr || maps::seen_by(line->observations, keyframe) ||
        !fits(*line, features.lines[static_cast<std::size_t>(m.feature)], pose, camera)) {
      continue;
    }

    // Two edges may coincide in one image by chance, so lines merge only if each
    // fits all keyframes of the other.
    const LineId other = map.line_of(keyframe, m.feature);

    if (!other.valid()) {
      map.observe(m.line, keyframe, m.feature);
      ++summary.observed;
    } else if (may_be_one(*line, map.line(other), pose) && fits_all(map, *line, map.line(other), cameras) &&
               fits_all(map, map.line(other), *line, cameras)) {
      merge(map, m.line, other);
      ++summary.merged;
    }
  }
}

}  // namespace

FusionSummary fuse_lines(maps::Map& map, KeyframeId keyframe, const std::vector<KeyframeId>& neighbours,
                         const std::map<std::int32_t, sensor::Pinhole>& cameras,
                         const FusionOptions& options) {
  FusionSummary summary;
  for (KeyframeId other : neighbours)
    fuse_into(map, unseen_lines(map, {keyframe}, other), other, cameras, options, summary);
  fuse_into(map, unseen_lines(map, neighbours, keyframe), keyframe, cameras, options, summary);
  return summary;
}

}  // namespace plumbline::mapping
