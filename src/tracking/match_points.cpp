// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "plumbline/tracking/association.hpp"

namespace plumbline::tracking {
namespace {

/// A landmark as it should appear in the image.
struct Prediction {
  float u = 0.0F;
  float v = 0.0F;
  int octave = 0;
};

/// A camera at a guess of its pose.
struct Viewer {
  const sensor::Pinhole& camera;
  const geometry::Rigid3& camera_from_world;
  Eigen::Vector3d centre;  ///< in the world
  double log_scale;        ///< of one octave
};

/// False if the landmark is not in the image, or was seen from another side or distance.
bool predict(const maps::MapPoint& point, const Viewer& viewer, double octaves_closer,
             Prediction& prediction) {
  const Eigen::Vector3d p = viewer.camera_from_world * point.position;
  if (p.z() < 0.1) return false;
  const Eigen::Vector2d pixel = viewer.camera.project(p);
  if (!viewer.camera.contains(pixel)) return false;
  const Eigen::Vector3d ray = point.position - viewer.centre;
  const double distance = ray.norm();
  if (ray.dot(point.view_direction) < 0.4 * distance) return false;  // seen from another side
  const double octave = point.reference_octave +
                        std::log(point.reference_distance / distance) / viewer.log_scale + octaves_closer;
  // Many landmarks of another camera are smaller than anything that this one can see.
  const double beyond = octaves_closer == 0.0 ? 2.5 : 0.5;
  if (octave < -beyond || octave > 7.0 + beyond) return false;
  prediction = {static_cast<float>(pixel.x()), static_cast<float>(pixel.y()),
                static_cast<int>(std::lround(octave))};
  return true;
}

/// By how many octaves the camera sees landmarks larger than their own cameras do from the same distance; by
/// robot.
std::vector<double> octaves_closer(const std::vector<double>& focals_px, const sensor::Pinhole& camera,
                                   double log_scale) {
  std::vector<double> octaves;
  octaves.reserve(focals_px.size());
  for (const double focal : focals_px) octaves.push_back(std::log(camera.fx / focal) / log_scale);
  return octaves;
}

/// Rotation of the image about its own axis since a keyframe, degrees; queried for many points one after
/// another.
class Roll {
 public:
  Roll(const maps::Map& map, const geometry::Rigid3& camera_from_world)
      : map_(map), camera_(camera_from_world) {}
  float since(core::KeyframeId keyframe) {
    if (!keyframe.valid() || !map_.has_keyframe(keyframe)) return 0.0F;
    const auto [found, inserted] = degrees_.try_emplace(keyframe, 0.0F);
    if (inserted) {
      // Once for each keyframe: rotation about the optical axis
      const Eigen::Matrix3d r = camera_.rotation * map_.camera_from_world(keyframe).rotation.transpose();
      found->second = static_cast<float>(std::atan2(r(1, 0), r(0, 0)) * 180.0 / 3.14159265358979);
    }
    return found->second;
  }

 private:
  const maps::Map& map_;
  const geometry::Rigid3& camera_;
  std::unordered_map<core::KeyframeId, float> degrees_;
};

float angle_between(float a, float b) {
  const float d = std::fmod(std::abs(a - b), 360.0F);
  return std::min(d, 360.0F - d);
}

/// The most similar of some corners, and the next best somewhere else: two corners of neighbouring octaves at
/// one place are the same corner.
struct BestTwo {
  int feature = -1;
  int distance = 257;
  int second = 257;
};

// Best and second best corner; several at one place count once.
BestTwo best_two(const std::vector<features::PointFeature>& corners, const std::vector<int>& near,
                 const std::vector<int>& distances) {
  constexpr float kSamePlace_px = 3.0F;
  BestTwo best;
  for (std::size_t i = 0; i < near.size(); ++i) {
    if (distances[i] >= best.second) continue;
    const bool elsewhere = best.feature < 0 || (corners[static_cast<std::size_t>(best.feature)].pixel -
                                                corners[static_cast<std::size_t>(near[i])].pixel)
                                                       .norm() >= kSamePlace_px;
    if (distances[i] < best.distance) {
      if (elsewhere) best.second = best.distance;
      best.distance = distances[i];
      best.feature = near[i];
    } else if (elsewhere) {
      best.second = distances[i];
    }
  }
  return best;
}

}  // namespace

void AssociationOptions::declare(core::OptionTable& table) {
  table.integer("match.max_hamming", max_hamming, {1, 256}, "bit",
                "Largest difference of matched point descriptors");
  table.number("match.ratio", ratio, {0.1, 1.0}, "", "Largest ratio of the best distance to the second best");
  table.boolean("match.align", align,
                "Align matched corners with the appearance of their landmark, to a tenth of a pixel");
  table.number("match.aligned_sigma", aligned_sigma, {0.01, 1.0}, "",
               "Standard deviation of aligned corners relative to others");
  table.integer("match.max_line_hamming", max_line_hamming, {1, 256}, "bit",
                "Largest difference of matched line descriptors");
  table.number("match.min_line_ratio", min_line_ratio, {0.0, 1.0}, "",
               "Shorter over longer of a predicted and a measured line, at least");
}

std::vector<PointMatch> match_points(const maps::Map& map, const std::vector<core::PointId>& points,
                                     const PosedFrame& posed, double radius,
                                     const AssociationOptions& options, std::vector<core::PointId>* visible) {
  const features::FrameFeatures& frame = posed.features;
  const Viewer viewer{posed.camera, posed.camera_from_world, posed.camera_from_world.inverse().translation,
                      std::log(options.scale_factor)};
  const std::vector<double> closer = octaves_closer(options.focals_px, viewer.camera, viewer.log_scale);
  Roll roll(map, viewer.camera_from_world);
  const auto max_turn = static_cast<float>(options.max_point_angle_rad * 180.0 / 3.14159265358979);
  std::vector<PointMatch> by_feature(frame.points.size());
  std::vector<int> near;

  std::vector<int> distances;
  for (core::PointId id : points) {
    const maps::MapPoint* point = map.find(id);
    Prediction prediction;
    const auto robot = static_cast<std::size_t>(id.robot);
    const double octaves = robot < closer.size() ? closer[robot] : 0.0;
    if (point == nullptr || !predict(*point, viewer, octaves, prediction)) continue;
    if (visible != nullptr) visible->push_back(id);

    // Corners near the prediction, farther on coarse levels
    near.clear();
    const double grown = radius * std::pow(options.scale_factor, std::clamp(prediction.octave, 0, 4));
    frame.grid.within(frame.points, prediction.u, prediction.v, static_cast<float>(grown), near);

    // Only corners of similar size and orientation
    const float angle = point->angle + roll.since(point->angle_keyframe);
    const auto unlike = [&](int i) {
      const features::PointFeature& f = frame.points[static_cast<std::size_t>(i)];
      return std::abs(f.octave - prediction.octave) > 1 || angle_between(f.angle, angle) > max_turn;
    };
    near.erase(std::remove_if(near.begin(), near.end(), unlike), near.end());
    if (near.empty()) continue;

    distances.clear();
    for (const int i : near) {
      const features::Descriptor256& other = frame.descriptors[static_cast<std::size_t>(i)];
      distances.push_back(features::hamming_distance(point->descriptor, other));
    }

    // Unambiguous matches; each corner keeps its best landmark
    const BestTwo best = best_two(frame.points, near, distances);
    if (best.distance > options.max_hamming || best.distance > options.ratio * best.second) continue;
    PointMatch& slot = by_feature[static_cast<std::size_t>(best.feature)];
    if (best.distance < slot.distance) slot = {id, best.feature, best.distance};
  }

  std::vector<PointMatch> matches;
  for (const PointMatch& m : by_feature) {
    if (m.feature >= 0) matches.push_back(m);
  }

  return matches;
}

}  // namespace plumbline::tracking
