// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "plumbline/tracking/association.hpp"

namespace plumbline::tracking {
namespace {

/// A landmark as it should appear in the picture.
struct Prediction {
  float u = 0.0F;
  float v = 0.0F;
  int octave = 0;
};

bool predict(const maps::MapPoint& point, const geometry::Rigid3& camera_from_world, const Eigen::Vector3d& centre,
             const sensor::Pinhole& camera, double log_scale, Prediction& prediction) {
  const Eigen::Vector3d p = camera_from_world * point.position;
  if (p.z() < 0.1) return false;
  const Eigen::Vector2d pixel = camera.project(p);
  if (!camera.contains(pixel)) return false;
  const Eigen::Vector3d ray = point.position - centre;
  const double distance = ray.norm();
  if (ray.dot(point.view_direction) < 0.4 * distance) return false;  // seen from another side
  const double octave = point.reference_octave + std::log(point.reference_distance / distance) / log_scale;
  if (octave < -2.5 || octave > 9.5) return false;
  prediction = {static_cast<float>(pixel.x()), static_cast<float>(pixel.y()),
                static_cast<int>(std::lround(octave))};
  return true;
}

}  // namespace

void AssociationOptions::declare(core::OptionTable& table) {
  table.integer("match.max_hamming", max_hamming, {1, 256}, "bit", "Point descriptors may differ by so many bits");
  table.number("match.ratio", ratio, {0.1, 1.0}, "", "Best distance over second best, at most");
  table.integer("match.max_line_hamming", max_line_hamming, {1, 256}, "bit",
                "Line descriptors may differ by so many bits");
  table.number("match.max_line_angle", max_line_angle_rad, {0.01, 1.6}, "rad",
               "Angle between a predicted and a measured line, at most");
}

std::vector<PointMatch> match_points(const maps::Map& map, const std::vector<core::PointId>& points,
                                     const features::FrameFeatures& frame, const sensor::Pinhole& camera,
                                     const geometry::Rigid3& camera_from_world, double radius,
                                     const AssociationOptions& options, std::vector<core::PointId>* visible) {
  const Eigen::Vector3d centre = camera_from_world.inverse().translation;
  const double log_scale = std::log(options.scale_factor);
  std::vector<PointMatch> by_feature(frame.points.size());
  std::vector<int> near;
  std::vector<int> distances;
  for (core::PointId id : points) {
    const maps::MapPoint* point = map.find_point(id);
    Prediction prediction;
    if (point == nullptr || !predict(*point, camera_from_world, centre, camera, log_scale, prediction)) continue;
    if (visible != nullptr) visible->push_back(id);
    near.clear();
    const double grown = radius * std::pow(options.scale_factor, std::clamp(prediction.octave, 0, 4));
    frame.grid.within(frame.points, prediction.u, prediction.v, static_cast<float>(grown), near);
    near.erase(std::remove_if(near.begin(), near.end(),
                              [&](int i) {
                                return std::abs(frame.points[static_cast<std::size_t>(i)].octave -
                                                prediction.octave) > 1;
                              }),
               near.end());
    if (near.empty()) continue;
    distances.resize(near.size());
    features::hamming_distances(point->descriptor, frame.descriptors.data(), near.data(), near.size(),
                                distances.data());
    int best = 257;
    int second = 257;
    int best_feature = -1;
    for (std::size_t i = 0; i < near.size(); ++i) {
      if (distances[i] < best) {
        // Two corners of neighbouring octaves at one place are the same corner, not a rival.
        const bool same_place =
            best_feature >= 0 && (frame.points[static_cast<std::size_t>(best_feature)].pixel -
                                  frame.points[static_cast<std::size_t>(near[i])].pixel).norm() < 3.0F;
        if (!same_place) second = best;
        best = distances[i];
        best_feature = near[i];
      } else if (distances[i] < second &&
                 (frame.points[static_cast<std::size_t>(best_feature)].pixel -
                  frame.points[static_cast<std::size_t>(near[i])].pixel).norm() >= 3.0F) {
        second = distances[i];
      }
    }
    if (best > options.max_hamming || best > options.ratio * second) continue;
    PointMatch& slot = by_feature[static_cast<std::size_t>(best_feature)];
    if (best < slot.distance) slot = {id, best_feature, best};
  }
  std::vector<PointMatch> matches;
  for (const PointMatch& m : by_feature) {
    if (m.feature >= 0) matches.push_back(m);
  }
  return matches;
}

}  // namespace plumbline::tracking
