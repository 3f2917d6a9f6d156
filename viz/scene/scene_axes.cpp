// SPDX-License-Identifier: BSD-3-Clause
// Upright direction and direction of the walls: peaks of the normals' distribution.
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "plumbline/cloud/fusion/floor.hpp"
#include "scene/view_frame.hpp"

namespace plumbline::viz {
namespace {

constexpr std::size_t kMaxNormals = 200000;

/// Unit normals of an even sample of the cloud.
std::vector<Eigen::Vector3d> sample_normals(const Scene& scene) {
  std::vector<Eigen::Vector3d> normals;
  if (scene.cloud == nullptr) return normals;
  const std::size_t step = std::max<std::size_t>(1, scene.cloud->size() / kMaxNormals);
  for (std::size_t i = 0; i < scene.cloud->size(); i += step) {
    const auto& p = (*scene.cloud)[i];
    const Eigen::Vector3d n(p.normal_x, p.normal_y, p.normal_z);
    const double length = n.norm();
    if (std::isfinite(length) && length > 0.1) normals.push_back(n / length);
  }
  return normals;
}

/// Mean horizontal direction of the optical axes; `otherwise` when they cancel out.
Eigen::Vector3d mean_heading(const Scene& scene, const Eigen::Vector3d& up,
                             const Eigen::Vector3d& otherwise) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double count = 0.0;
  for (const CameraPath& path : scene.paths) {
    for (const auto& pose : path.trajectory) {
      if (!pose.world_from_camera.rotation.allFinite()) continue;
      sum += pose.world_from_camera.rotation.col(2);
      count += 1.0;
    }
  }
  const Eigen::Vector3d flat = sum - sum.dot(up) * up;
  return flat.norm() > 0.3 * std::max(1.0, count) ? flat.normalized() : otherwise;
}

/// Any unit vector perpendicular to v, preferring `wish`.
Eigen::Vector3d perpendicular(const Eigen::Vector3d& v, const Eigen::Vector3d& wish) {
  for (const Eigen::Vector3d& candidate :
       {wish, Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 1, 0)}) {
    const Eigen::Vector3d flat = candidate - candidate.dot(v) * v;
    if (flat.norm() > 0.1) return flat.normalized();
  }
  return v.unitOrthogonal();
}

/// Turns `forward` about `up` by at most 45 degrees to where walls at right angles put most normals; leaves
/// it when no such directions stand out.
Eigen::Vector3d along_walls(const std::vector<Eigen::Vector3d>& normals, const Eigen::Vector3d& up,
                            const Eigen::Vector3d& forward) {
  const Eigen::Vector3d right = forward.cross(up);
  std::array<double, 90> count{};
  double total = 0.0;

  // Histogram of wall directions, modulo 90 degrees.
  std::vector<double> angles;
  for (const Eigen::Vector3d& n : normals) {
    if (std::abs(n.dot(up)) > 0.25) continue;
    double angle = std::atan2(n.dot(right), n.dot(forward)) / kDegree;
    angle -= 90.0 * std::floor(angle / 90.0);  // walls at right angles fall together
    angles.push_back(angle);
    count[std::min<std::size_t>(89, static_cast<std::size_t>(angle))] += 1.0;
    total += 1.0;
  }

  // The strongest window of nine degrees.
  std::size_t peak = 0;
  double best = -1.0;
  for (std::size_t i = 0; i < 90; ++i) {
    double sum = 0.0;
    for (std::size_t d = 0; d < 9; ++d) sum += count[(i + 86 + d) % 90];
    if (sum > best) {
      best = sum;
      peak = i;
    }
  }

  // Directions must stand out from a uniform spread.
  if (total < 100.0 || best < 1.6 * total * 9.0 / 90.0) return forward;

  // Mean offset from the peak, for precision.
  double offset_sum = 0.0;
  double used = 0.0;
  for (const double angle : angles) {
    const double offset = std::remainder(angle - (static_cast<double>(peak) + 0.5), 90.0);
    if (std::abs(offset) > 6.0) continue;
    offset_sum += offset;
    used += 1.0;
  }

  const double turn =
      std::remainder(static_cast<double>(peak) + 0.5 + offset_sum / std::max(1.0, used), 90.0) * kDegree;
  return (std::cos(turn) * forward + std::sin(turn) * right).normalized();
}

}  // namespace

Eigen::Vector3d mean_camera_up(const std::vector<geometry::Trajectory>& paths) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const geometry::Trajectory& path : paths) {
    for (const auto& pose : path) {
      // y of a camera points down.
      if (pose.world_from_camera.rotation.allFinite()) sum -= pose.world_from_camera.rotation.col(1);
    }
  }
  return sum.norm() > 1e-6 ? sum.normalized() : Eigen::Vector3d(0.0, -1.0, 0.0);
}

Eigen::Vector3d estimate_up(const Scene& scene) {
  std::vector<geometry::Trajectory> paths;
  for (const CameraPath& path : scene.paths) paths.push_back(path.trajectory);
  const Eigen::Vector3d about = mean_camera_up(paths);
  const auto floor = cloud::find_floor(scene.cloud, about);
  return floor ? floor->normal : about;
}

SceneAxes scene_axes(const Scene& scene, const SnapshotOptions& options) {
  SceneAxes axes;
  const bool given = options.up.has_value() && options.up->allFinite() && options.up->norm() > 1e-9;
  axes.up = given ? options.up->normalized() : estimate_up(scene);
  Eigen::Vector3d looks(0.0, 0.0, 1.0);
  for (const CameraPath& path : scene.paths) {
    if (path.trajectory.empty()) continue;
    const Eigen::Matrix3d& rotation = path.trajectory.front().world_from_camera.rotation;
    // A camera that looks straight down has its heading in the picture's up direction.
    const bool steep = std::abs(rotation.col(2).dot(axes.up)) > 0.9;
    looks = steep ? Eigen::Vector3d(-rotation.col(1)) : Eigen::Vector3d(rotation.col(2));
    break;
  }
  axes.forward = along_walls(sample_normals(scene), axes.up, perpendicular(axes.up, looks));
  axes.right = axes.forward.cross(axes.up);
  axes.heading = mean_heading(scene, axes.up, axes.forward);
  return axes;
}

}  // namespace plumbline::viz
