// SPDX-License-Identifier: BSD-3-Clause
#include "results/up_frame.hpp"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <array>
#include <cmath>
#include <optional>

#include "plumbline/cloud/fusion/floor.hpp"
#include "plumbline/viz/snapshot.hpp"

namespace plumbline::pipeline {

namespace {

constexpr double kQuarter = M_PI / 2.0;

/// The angle about z, in [-45, 45) degrees, from `axes` to the direction that most upright surface is square
/// to.
std::optional<double> wall_angle(const cloud::Cloud& cloud, const Eigen::Matrix3d& axes) {
  constexpr int kBins = 180;         // of half a degree, in a quarter of a turn
  constexpr int kNear = 4;           // bins to each side
  constexpr double kUpright = 0.26;  // most of a wall's normal that is vertical: 15 degrees
  constexpr double kLeastShare = 1.0 / 3.0;
  const auto bin = [](double angle) {
    const double turn = angle / kQuarter;
    return static_cast<int>((turn - std::floor(turn)) * kBins) % kBins;
  };

  // Walls of a room meet at right angles, so directions are compared modulo a quarter turn. Four times the
  // angle makes that a full turn, in which the mean has no jump at the ends.
  std::array<double, kBins> weight{};
  std::array<Eigen::Vector2d, kBins> sum;
  sum.fill(Eigen::Vector2d::Zero());

  double all = 0.0;
  for (const cloud::Point& p : cloud) {
    const Eigen::Vector3d normal = axes.transpose() * p.getNormalVector3fMap().cast<double>();
    if (!normal.allFinite() || std::abs(normal.z()) > kUpright) continue;
    const double angle = std::atan2(normal.y(), normal.x());
    const auto b = static_cast<std::size_t>(bin(angle));
    weight[b] += 1.0;
    sum[b] += Eigen::Vector2d(std::cos(4.0 * angle), std::sin(4.0 * angle));
    all += 1.0;
  }

  // Neighbouring bins count together, as noise of the normals spreads one wall over several of them.
  const auto near = [&](const auto& of, int middle) {
    auto result = of[static_cast<std::size_t>(middle)];
    for (int k = 1; k <= kNear; ++k) {
      result += of[static_cast<std::size_t>((middle + k) % kBins)];
      result += of[static_cast<std::size_t>((middle + kBins - k) % kBins)];
    }
    return result;
  };

  int best = 0;
  for (int b = 1; b < kBins; ++b) {
    if (near(weight, b) > near(weight, best)) best = b;
  }

  // Without a dominant direction, a turn by the strongest bin would be arbitrary.
  if (all == 0.0 || near(weight, best) < kLeastShare * all) return std::nullopt;
  const Eigen::Vector2d mean = near(sum, best);
  return std::atan2(mean.y(), mean.x()) / 4.0;
}

}  // namespace

UpFrame find_up(Up wanted, Yaw yaw, const cloud::CloudConstPtr& cloud,
                const geometry::Trajectory& trajectory) {
  UpFrame frame;
  if (wanted == Up::kNone || trajectory.empty()) return frame;

  const geometry::Rigid3& first = trajectory.front().world_from_camera;

  // The y axis of a camera points down: until a floor is found, up is -y of the first camera.
  Eigen::Vector3d up = -first.rotation.col(1);
  double ground = up.dot(first.translation);
  frame.up = "camera";

  if (wanted == Up::kFloor) {
    if (const auto floor = cloud::find_floor(cloud, viz::mean_camera_up({trajectory}))) {
      up = floor->normal;
      ground = floor->height_m;
      frame.up = "floor";
    }
  }

  // A camera that looks straight up or down has no heading; the vertical axis of its image stands in.
  Eigen::Vector3d ahead = first.rotation.col(2) - first.rotation.col(2).dot(up) * up;
  if (ahead.norm() < 0.1) ahead = first.rotation.col(1) - first.rotation.col(1).dot(up) * up;
  Eigen::Matrix3d axes;  // of the output in the map
  axes.col(2) = up.normalized();
  axes.col(0) = ahead.normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));

  const auto walls = yaw == Yaw::kWalls && cloud != nullptr ? wall_angle(*cloud, axes) : std::nullopt;
  frame.yaw = walls ? "walls" : "camera";
  if (walls) axes *= Eigen::AngleAxisd(*walls, Eigen::Vector3d::UnitZ()).toRotationMatrix();

  // The origin is the first camera or, with a floor, the point of the floor below it.
  const Eigen::Vector3d origin = first.translation + (ground - up.dot(first.translation)) * up;
  frame.output_from_map = geometry::Rigid3(axes, origin).inverse();
  return frame;
}

}  // namespace plumbline::pipeline
