// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/tracking/align_points.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace plumbline::tracking {
namespace {

/// Appearance of a landmark in the keyframe that saw it.
struct Sight {
  const features::CornerPatch* patch = nullptr;
  int octave = 0;                    ///< of the patch
  double farther = 0.0;              ///< octaves by which the landmark is farther away now
  Eigen::Matrix2f frame_from_patch;  ///< distances of pixels of the full images
};

/// A camera at a guess of its pose.
struct Place {
  const sensor::Pinhole& camera;
  const geometry::Rigid3& camera_from_world;
  double log_scale;  ///< of one octave
};

/// None when the keyframe saw it from a direction or at a distance that is too different.
std::optional<Sight> sight_of(const maps::Map& map, const maps::Observation& seen,
                              const Eigen::Vector3d& position, const Eigen::Vector3d& normal,
                              const Place& place) {
  constexpr double kLeastCosine = 0.9;
  constexpr double kMostOblique = 0.15;  // cosine: normals are not known well enough
  constexpr double kMostOctaves = 3.5;
  constexpr double kNearest_m = 0.05;
  const maps::Keyframe& keyframe = map.keyframe(seen.keyframe);
  const auto feature = static_cast<std::size_t>(seen.feature);
  if (keyframe.features == nullptr || feature >= keyframe.features->patches.size()) return std::nullopt;

  const geometry::Rigid3& there_from_world = map.camera_from_world(seen.keyframe);
  const Eigen::Vector3d here = place.camera_from_world * position;
  const Eigen::Vector3d there = there_from_world * position;
  if (there.z() < kNearest_m) return std::nullopt;

  const geometry::Rigid3 here_from_there = place.camera_from_world * there_from_world.inverse();
  if ((here_from_there.rotation * there).dot(here) < kLeastCosine * there.norm() * here.norm())
    return std::nullopt;

  Sight sight;
  sight.farther = std::log(here.norm() / there.norm()) / place.log_scale;
  if (std::abs(sight.farther) > kMostOctaves) return std::nullopt;

  // Its surface there, or a plane across the line of sight, seen from here: one pixel each way.
  const Eigen::Vector3d facing = there_from_world.rotation * normal;

  const bool slanted = -facing.dot(there) > kMostOblique * there.norm();
  const Eigen::Vector3d across = slanted ? facing : there;
  const sensor::Pinhole& camera = place.camera;
  const Eigen::Vector2d at = camera.project(there);
  const auto carried = [&](double du, double dv) {
    const Eigen::Vector3d ray = camera.unproject(at.x() + du, at.y() + dv, 1.0);
    return Eigen::Vector2d(camera.project(here_from_there * (ray * (across.dot(there) / across.dot(ray)))));
  };

  // Central differences of the mapping from patch to frame
  sight.frame_from_patch.col(0) = (0.5 * (carried(1.0, 0.0) - carried(-1.0, 0.0))).cast<float>();
  sight.frame_from_patch.col(1) = (0.5 * (carried(0.0, 1.0) - carried(0.0, -1.0))).cast<float>();
  sight.patch = &keyframe.features->patches[feature];
  sight.octave = keyframe.features->points[feature].octave;
  return sight;
}

/// The first keyframe that saw the landmark from a direction and at a distance not too different: newer ones
/// were aligned with older ones and accumulate their errors.
std::optional<Sight> first_sight(const maps::Map& map, const maps::MapPoint& point, const Place& place) {
  for (const maps::Observation& o : point.observations) {
    if (!o.aligned) continue;
    const auto sight = sight_of(map, o, point.position, point.normal, place);
    if (sight) return sight->frame_from_patch.allFinite() ? sight : std::nullopt;
  }
  return std::nullopt;
}

/// Position in the image at which the patch is found, pixels of the full image; `start`: expected position.
std::optional<Eigen::Vector2f> align(const Sight& sight, const std::vector<cv::Mat>& levels,
                                     const Eigen::Vector2f& start, double scale_factor) {
  const int last = static_cast<int>(levels.size()) - 1;
  const int octave = std::clamp(static_cast<int>(std::lround(sight.octave - sight.farther)), 0, last);
  const cv::Mat& level = levels[static_cast<std::size_t>(octave)];
  const Eigen::Array2f shrink(static_cast<float>(level.cols) / static_cast<float>(levels.front().cols),
                              static_cast<float>(level.rows) / static_cast<float>(levels.front().rows));
  const auto patch_pixel = static_cast<float>(std::pow(scale_factor, sight.octave));
  const Eigen::Matrix2f level_from_patch =
      shrink.matrix().asDiagonal() * sight.frame_from_patch * patch_pixel;
  const Eigen::Vector2f beside = sight.frame_from_patch * sight.patch->offset;
  const Eigen::Vector2f from = (((start - beside).array() + 0.5F) * shrink - 0.5F).matrix();
  const auto found = features::align_patch(*sight.patch, level, from, level_from_patch);
  if (!found) return std::nullopt;
  return ((found->array() + 0.5F) / shrink - 0.5F).matrix() + beside;
}

}  // namespace

void align_points(const maps::Map& map, const features::FrameFeatures& frame, const sensor::Pinhole& camera,
                  const geometry::Rigid3& camera_from_world, double scale_factor,
                  std::vector<PointMatch>& matches) {
  for (PointMatch& m : matches) {
    m.aligned = false;
    m.shift.setZero();
  }
  if (frame.levels.empty() || frame.patches.size() != frame.points.size()) return;
  const Place place{camera, camera_from_world, std::log(scale_factor)};

  // Shift of the corner against an earlier observation
  for (PointMatch& m : matches) {
    const auto sight = first_sight(map, map.point(m.point), place);
    if (!sight) continue;
    const Eigen::Vector2f& corner = frame.patches[static_cast<std::size_t>(m.feature)].middle;
    const auto found = align(*sight, frame.levels, corner, scale_factor);
    if (!found) continue;
    m.shift = *found - corner;
    m.aligned = true;
  }
}

std::optional<Eigen::Vector2f> align_observation(const maps::Map& map, const maps::Observation& seen,
                                                 const Eigen::Vector3d& position, const PosedImage& image,
                                                 const Eigen::Vector2f& start) {
  if (image.levels.empty()) return std::nullopt;
  const auto sight = sight_of(map, seen, position, Eigen::Vector3d::Zero(),
                              {image.camera, image.camera_from_world, std::log(image.scale_factor)});
  if (!sight || !sight->frame_from_patch.allFinite() || sight->patch->empty()) return std::nullopt;
  return align(*sight, image.levels, start, image.scale_factor);
}

}  // namespace plumbline::tracking
