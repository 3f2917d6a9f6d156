// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/earlier_observations.hpp"

#include <algorithm>
#include <cmath>

#include "plumbline/core/numbers.hpp"
#include "plumbline/tracking/align_points.hpp"

namespace plumbline::mapping {
namespace {

using core::KeyframeId;
using core::PointId;
using tracking::PointMatch;

constexpr double kRadius_px = 8.0;  // at octave 0; the older pose may be off by a quarter of a degree
constexpr float kAlike_px = 2.0F;   // corners lie off their projections all alike, but for parallax
constexpr std::size_t kFew = 8;     // matches do not bear each other out

/// Takes out matches with corners that see something already, and those that do not lie off like the others.
void keep_alike(const maps::Map& map, KeyframeId keyframe, const sensor::Pinhole& camera, double scale_factor,
                std::vector<PointMatch>& matches) {
  const features::FrameFeatures& features = *map.keyframe(keyframe).features;
  const geometry::Rigid3& pose = map.camera_from_world(keyframe);
  const auto sees_something = [&](const PointMatch& m) { return map.point_of(keyframe, m.feature).valid(); };
  matches.erase(std::remove_if(matches.begin(), matches.end(), sees_something), matches.end());
  if (matches.size() < kFew) {
    matches.clear();
    return;
  }
  const auto off = [&](const PointMatch& m) -> Eigen::Vector2f {
    return features.points[static_cast<std::size_t>(m.feature)].pixel -
           camera.project(pose * map.point(m.point).position).cast<float>();
  };
  std::vector<float> x, y;
  for (const PointMatch& m : matches) {
    const Eigen::Vector2f d = off(m);
    x.push_back(d.x());
    y.push_back(d.y());
  }
  const Eigen::Vector2f middle(core::median(std::move(x)), core::median(std::move(y)));
  const auto differs = [&](const PointMatch& m) {
    const int octave = features.points[static_cast<std::size_t>(m.feature)].octave;
    return (off(m) - middle).norm() > kAlike_px * static_cast<float>(std::pow(scale_factor, octave));
  };
  matches.erase(std::remove_if(matches.begin(), matches.end(), differs), matches.end());
}

}  // namespace

int add_earlier_observations(maps::Map& map, const std::vector<PointId>& landmarks, KeyframeId keyframe,
                             const std::vector<KeyframeId>& older, const std::vector<cv::Mat>& levels,
                             const sensor::Pinhole& camera, const tracking::AssociationOptions& options,
                             features::FrameFeatures& newest) {
  if (levels.empty() || newest.patches.size() != newest.points.size()) return 0;
  const geometry::Rigid3 pose = map.camera_from_world(keyframe);
  std::vector<PointId> wanted = landmarks;
  int found = 0;
  for (const KeyframeId other : older) {
    if (other == keyframe || wanted.empty()) continue;
    const maps::Keyframe& there = map.keyframe(other);
    if (there.features == nullptr) continue;
    std::vector<PointMatch> matches = tracking::match_points(
        map, wanted, *there.features, camera, map.camera_from_world(other), kRadius_px, options, nullptr);
    keep_alike(map, other, camera, options.scale_factor, matches);
    for (const PointMatch& m : matches) {
      maps::MapPoint& point = map.point(m.point);
      const auto corner = static_cast<std::size_t>(point.observations.front().feature);
      if (newest.patches[corner].empty()) continue;  // at a border: no surface that both could see
      const Eigen::Vector2f& middle = newest.patches[corner].middle;
      const auto at = tracking::align_observation(map, {other, m.feature}, point.position, levels, middle,
                                                  camera, pose, options.scale_factor);
      if (!at) continue;
      if (!map.observe(m.point, other, m.feature, true)) continue;
      newest.move_point(corner, *at - middle);
      point.position = pose.inverse() * camera.unproject(static_cast<double>(newest.points[corner].pixel.x()),
                                                         static_cast<double>(newest.points[corner].pixel.y()),
                                                         static_cast<double>(newest.points[corner].depth));
      map.refresh_point(m.point);
      ++found;
    }
    const auto seen = [&](PointId id) { return map.point(id).observations.size() > 1; };
    wanted.erase(std::remove_if(wanted.begin(), wanted.end(), seen), wanted.end());
  }
  if (found > 0) newest.grid = features::PointGrid(newest.points, camera.width, camera.height);
  return found;
}

}  // namespace plumbline::mapping
