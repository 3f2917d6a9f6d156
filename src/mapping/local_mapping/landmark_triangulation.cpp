// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/local_mapping/landmark_triangulation.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "plumbline/tracking/align_points.hpp"

namespace plumbline::mapping {
namespace {

using core::KeyframeId;
using geometry::Rigid3;

constexpr double kReprojectionGate = 5.99;  // chi-square, 2 degrees of freedom, 95 %
constexpr double kEpipolarGate_px = 2.0;    // at octave 0
constexpr double kAlternative_px = 3.0;     // corners of several octaves at one place are one corner
constexpr double kMaxScaleChange = 1.8;     // of a corner's size in space, between its two images

/// Data of one keyframe for the search.
struct FreeCorners {
  const features::FrameFeatures& features;
  const Rigid3& camera_from_world;
  std::vector<int> free;  ///< corners that see no landmark and have no depth
};

FreeCorners free_corners_of(const maps::Map& map, KeyframeId id, double max_measured_m) {
  FreeCorners view{*map.keyframe(id).features, map.camera_from_world(id), {}};
  for (std::size_t i = 0; i < view.features.points.size(); ++i) {
    const auto depth = static_cast<double>(view.features.points[i].depth);
    const bool measured = depth > 0.0 && depth <= max_measured_m;
    if (!measured && !map.point_of(id, static_cast<int>(i)).valid()) view.free.push_back(static_cast<int>(i));
  }
  return view;
}

double angle_between(double a, double b) {
  const double d = std::fmod(std::abs(a - b), 360.0);
  return std::min(d, 360.0 - d);
}

class PairSearch {
 public:
  PairSearch(const FreeCorners& first, const FreeCorners& second, const sensor::Pinhole& camera,
             const TriangulationOptions& options)
      : a_(first), b_(second), camera_(camera), options_(options) {
    b_from_a_ = b_.camera_from_world * a_.camera_from_world.inverse();
    Eigen::Matrix3d inverse;
    inverse << 1.0 / camera.fx, 0.0, -camera.cx / camera.fx, 0.0, 1.0 / camera.fy, -camera.cy / camera.fy,
        0.0, 0.0, 1.0;
    fundamental_ = inverse.transpose() * geometry::skew(b_from_a_.translation) * b_from_a_.rotation * inverse;
    roll_deg_ = std::atan2(b_from_a_.rotation(1, 0), b_from_a_.rotation(0, 0)) * 180.0 / M_PI;
  }

  /// The corner of the second image that matches corner `i` of the first; -1: none is clearly best.
  [[nodiscard]] int partner(int i) const {
    const features::PointFeature& f = a_.features.points[static_cast<std::size_t>(i)];
    const Eigen::Vector3d line = fundamental_ * f.pixel.cast<double>().homogeneous();
    const double norm = line.head<2>().norm();
    if (!(norm > 1e-12)) return -1;

    int best = -1;
    int best_distance = 257;
    int second_distance = 257;

    for (int j : b_.free) {
      const features::PointFeature& g = b_.features.points[static_cast<std::size_t>(j)];
      const double off = std::abs(line.dot(g.pixel.cast<double>().homogeneous())) / norm;
      if (off > kEpipolarGate_px * sigma(g) || !alike(f, g)) continue;

      const int distance = features::hamming_distance(a_.features.descriptors[static_cast<std::size_t>(i)],
                                                      b_.features.descriptors[static_cast<std::size_t>(j)]);
      const bool alternative = best < 0 || (g.pixel - pixel_of(best)).norm() > kAlternative_px;

      if (distance < best_distance) {
        if (alternative) second_distance = best_distance;
        best_distance = distance;
        best = j;
      } else if (alternative && distance < second_distance) {
        second_distance = distance;
      }
    }

    // Strictly less: two candidates that look exactly alike are ambiguous.
    const bool clear =
        best_distance <= options_.max_hamming && best_distance < options_.ratio * second_distance;
    return clear ? best : -1;
  }

  /// Intersection of the rays of corner `f` of the first image and corner `g` of the second, in the first
  /// camera's frame; none if they do not meet, or meet too far away to be located. `noise`: noise of both
  /// corners, relative to that of corners as they are detected.
  [[nodiscard]] std::optional<Eigen::Vector3d> meet(const features::PointFeature& f,
                                                    const features::PointFeature& g, double noise) const {
    const Eigen::Vector3d ray_a = ray(f);
    const Eigen::Vector3d ray_b = b_from_a_.rotation.transpose() * ray(g);
    const Eigen::Vector3d centre_b = b_from_a_.inverse().translation;
    const double parallax = std::atan2(ray_a.cross(ray_b).norm(), ray_a.dot(ray_b));
    const double ray_sigma = noise * std::hypot(sigma(f), sigma(g)) / camera_.fx;
    if (!(ray_sigma < options_.max_relative_sigma * parallax)) return std::nullopt;

    // Nearest points of the two rays: s along a, t along b.
    const double c = ray_a.dot(ray_b);
    const double da = ray_a.dot(centre_b);
    const double db = ray_b.dot(centre_b);
    const double s = (da - c * db) / (1.0 - c * c);
    const double t = (c * da - db) / (1.0 - c * c);
    if (!(s > 0.1) || !(t > 0.1)) return std::nullopt;

    const Eigen::Vector3d point = 0.5 * (s * ray_a + centre_b + t * ray_b);
    if (!(point.z() > 0.1) || point.z() > options_.max_depth_m) return std::nullopt;
    const Eigen::Vector3d in_b = b_from_a_ * point;
    if (!(in_b.z() > 0.1) || !fits(point, f) || !fits(in_b, g)) return std::nullopt;

    const double size_a = point.norm() * std::pow(options_.scale_factor, f.octave);
    const double size_b = in_b.norm() * std::pow(options_.scale_factor, g.octave);
    if (std::abs(std::log(size_a / size_b)) > std::log(kMaxScaleChange)) return std::nullopt;

    return point;
  }

 private:
  [[nodiscard]] double sigma(const features::PointFeature& f) const {
    return std::pow(options_.scale_factor, f.octave);
  }
  [[nodiscard]] const Eigen::Vector2f& pixel_of(int j) const {
    return b_.features.points[static_cast<std::size_t>(j)].pixel;
  }
  [[nodiscard]] bool alike(const features::PointFeature& f, const features::PointFeature& g) const {
    constexpr int kMaxOctaves = 2;
    return std::abs(f.octave - g.octave) <= kMaxOctaves &&
           angle_between(static_cast<double>(f.angle) + roll_deg_, static_cast<double>(g.angle)) <=
               options_.max_angle_rad * 180.0 / M_PI;
  }
  [[nodiscard]] Eigen::Vector3d ray(const features::PointFeature& f) const {
    return camera_.unproject(static_cast<double>(f.pixel.x()), static_cast<double>(f.pixel.y()), 1.0)
        .normalized();
  }
  [[nodiscard]] bool fits(const Eigen::Vector3d& in_camera, const features::PointFeature& f) const {
    const double s = sigma(f);
    return (camera_.project(in_camera) - f.pixel.cast<double>()).squaredNorm() < kReprojectionGate * s * s;
  }

  const FreeCorners& a_;
  const FreeCorners& b_;
  const sensor::Pinhole& camera_;
  const TriangulationOptions& options_;
  Rigid3 b_from_a_;
  Eigen::Matrix3d fundamental_;  ///< line in b = F * homogeneous pixel of a
  double roll_deg_ = 0.0;
};

struct Meeting {
  Eigen::Vector3d point;                 ///< in the newest camera's frame
  std::optional<Eigen::Vector2f> shift;  ///< px, from the newest corner to the older one's patch
};

/// Intersection of two corners' rays. Corners as they are detected need a long baseline for it; the newest
/// one is therefore located again with the older one's patch.
std::optional<Meeting> meet(const maps::Map& map, const PairSearch& search, const maps::Observation& newest,
                            const maps::Observation& older, const sensor::Pinhole& camera,
                            const TriangulationOptions& options, const NewestImage* image) {
  const auto point_of = [&](const maps::Observation& c) -> const features::PointFeature& {
    return map.keyframe(c.keyframe).features->points[static_cast<std::size_t>(c.feature)];
  };

  const auto alone = [&]() -> std::optional<Meeting> {
    const auto point = search.meet(point_of(newest), point_of(older), 1.0);
    if (!point) return std::nullopt;
    return Meeting{*point, std::nullopt};
  };
  if (image == nullptr) return alone();

  const features::CornerPatch& patch = image->newest.patches[static_cast<std::size_t>(newest.feature)];
  if (patch.empty()) return alone();

  // An aligned corner needs less parallax, so the noise of aligned corners decides whether to try. The rough
  // point serves only to project the older patch.
  const auto rough = search.meet(point_of(newest), point_of(older), options.aligned);
  if (!rough) return std::nullopt;

  const Rigid3& pose = map.camera_from_world(newest.keyframe);
  const auto at = tracking::align_observation(
      map, older, pose.inverse() * *rough, {image->levels, camera, pose, options.scale_factor}, patch.middle);
  if (!at) return alone();

  // The rays are intersected again with the corner at its aligned position.
  const Eigen::Vector2f shift = *at - patch.middle;
  features::PointFeature moved = point_of(newest);
  moved.pixel += shift;
  const auto point = search.meet(moved, point_of(older), options.aligned);
  if (!point) return std::nullopt;

  return Meeting{*point, shift};
}

core::PointId add_landmark(maps::Map& map, KeyframeId keyframe, int feature,
                           const Eigen::Vector3d& in_camera) {
  const features::FrameFeatures& features = *map.keyframe(keyframe).features;
  const features::PointFeature& f = features.points[static_cast<std::size_t>(feature)];
  maps::MapPoint point;
  point.position = map.camera_from_world(keyframe).inverse() * in_camera;
  point.descriptor = features.descriptors[static_cast<std::size_t>(feature)];
  point.angle = f.angle;
  point.angle_keyframe = keyframe;
  point.reference_distance = in_camera.norm();
  point.reference_octave = f.octave;
  point.visible = 1;
  point.found = 1;
  const core::PointId id = map.add_point(keyframe.robot, point);
  map.observe(id, keyframe, feature, true);
  return id;
}

}  // namespace

void TriangulationOptions::declare(core::OptionTable& table) {
  table.integer("triangulate.keyframes", keyframes, {1, 50}, "",
                "Number of neighbouring keyframes to search");
  table.number("triangulate.max_sigma", max_relative_sigma, {0.001, 1.0}, "",
               "Largest standard deviation of a triangulated depth, relative to that depth");
  table.integer("triangulate.line_views", min_line_views, {2, 10}, "",
                "Number of keyframes that must agree on a line without depth");
}

std::vector<core::PointId> triangulate_points(maps::Map& map, KeyframeId keyframe,
                                              const std::vector<KeyframeId>& neighbours,
                                              double max_measured_m, const sensor::Pinhole& camera,
                                              const TriangulationOptions& options, const NewestImage* image) {
  std::vector<core::PointId> made;
  const bool aligns = image != nullptr && !image->levels.empty() &&
                      image->newest.patches.size() == image->newest.points.size();
  const NewestImage* const shown = aligns ? image : nullptr;

  bool moved = false;
  for (KeyframeId other : neighbours) {
    // The free corners are collected again for each neighbour, because some of
    // them have got a landmark since.
    const FreeCorners a = free_corners_of(map, keyframe, max_measured_m);
    const FreeCorners b = free_corners_of(map, other, max_measured_m);
    const PairSearch search(a, b, camera, options);

    for (int i : a.free) {
      const int j = search.partner(i);
      if (j < 0 || map.point_of(other, j).valid()) continue;
      const auto found = meet(map, search, {keyframe, i}, {other, j}, camera, options, shown);
      if (!found) continue;

      // The keyframe's corner moves to where it was aligned, so that both keyframes see the landmark exactly.
      if (found->shift) {
        shown->newest.move_point(static_cast<std::size_t>(i), *found->shift);
        moved = true;
      }

      const core::PointId id = add_landmark(map, keyframe, i, found->point);
      map.observe(id, other, j, found->shift.has_value());
      map.refresh_point(id);
      made.push_back(id);
    }
  }

  // The grid sorts corners by position and is outdated once some have moved.
  if (moved) shown->newest.grid = features::PointGrid(shown->newest.points, camera.width, camera.height);
  return made;
}

}  // namespace plumbline::mapping
