// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <utility>

#include "plumbline/inertial/body_motion.hpp"

namespace plumbline::inertial {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using geometry::Rigid3;

namespace {

Vector3d place_of(const PathFrame& frame) { return frame.camera_from_world->inverse().translation; }

/// Velocity of the camera's centre just before a frame (`step` -1) or after it (+1); none: not known.
std::optional<Vector3d> velocity_beside(const std::vector<PathFrame>& path, std::size_t at, int step) {
  constexpr double kLongest_s = 0.2;
  if ((step < 0 && at == 0) || (step > 0 && at + 1 >= path.size())) return std::nullopt;
  const PathFrame& other = path[step < 0 ? at - 1 : at + 1];
  const double dt = other.stamp - path[at].stamp;
  if (!other.camera_from_world || std::abs(dt) > kLongest_s || dt == 0.0) return std::nullopt;
  return (place_of(other) - place_of(path[at])) / dt;
}

/// Between two frames, by the cubic with the velocities at both ends, or straight on.
Vector3d place_between(const std::vector<PathFrame>& path, std::size_t a, std::size_t b, double s) {
  const Vector3d from = place_of(path[a]), to = place_of(path[b]);
  const auto leaves = velocity_beside(path, a, -1), comes = velocity_beside(path, b, 1);
  const double dt = path[b].stamp - path[a].stamp;
  const Vector3d straight = to - from;
  const Vector3d at_a = leaves ? Vector3d(dt * *leaves) : straight,
                 at_b = comes ? Vector3d(dt * *comes) : straight;
  const double s2 = s * s, s3 = s2 * s;
  return from + (3.0 * s2 - 2.0 * s3) * straight + (s3 - 2.0 * s2 + s) * at_a + (s3 - s2) * at_b;
}

}  // namespace

std::vector<std::size_t> bridge(const TurnRates& rates, const GyroCalibration& how,
                                std::vector<PathFrame>& path) {
  constexpr double kLongest_s = 1.0;
  constexpr double kMostOff_rad = 0.1;  // difference at the other end; more is another place
  std::vector<std::size_t> bridged;
  std::size_t last = path.size();
  for (std::size_t i = 0; i < path.size(); ++i) {
    if (!path[i].camera_from_world) continue;
    const std::size_t first = std::exchange(last, i);
    if (first >= i || first + 1 == i || path[i].stamp - path[first].stamp > kLongest_s) continue;

    // The gyroscope's error at the other end is distributed.
    const auto turned = rates.turned(path[first].stamp, path[i].stamp, how);
    if (!turned) continue;
    const Matrix3d& begin = path[first].camera_from_world->rotation;
    const Vector3d off =
        geometry::log_so3(path[i].camera_from_world->rotation * (*turned * begin).transpose());
    if (off.norm() > kMostOff_rad) continue;

    // The error grows evenly over the gap.
    for (std::size_t k = first + 1; k < i; ++k) {
      const auto so_far = rates.turned(path[first].stamp, path[k].stamp, how);
      if (!so_far) continue;
      const double s = (path[k].stamp - path[first].stamp) / (path[i].stamp - path[first].stamp);
      const Matrix3d rotation = geometry::exp_so3(s * off) * *so_far * begin;
      path[k].camera_from_world = Rigid3(rotation, -(rotation * place_between(path, first, i, s)));
      bridged.push_back(k);
    }
  }
  return bridged;
}

std::optional<FeltUp> felt_up(const TurnRates& rates, const GyroCalibration& how,
                              const std::vector<PathFrame>& path) {
  std::vector<Vector3d> felt;
  Vector3d sum = Vector3d::Zero();

  // Accelerations, turned into the world.
  for (std::size_t i = 1; i < path.size(); ++i) {
    if (!path[i].camera_from_world || path[i].stamp - path[i - 1].stamp > 1.0) continue;
    const auto force = rates.acceleration(path[i - 1].stamp + how.delay_s, path[i].stamp + how.delay_s);
    if (!force) continue;
    felt.push_back(path[i].camera_from_world->rotation.transpose() * (how.camera_from_imu * *force));
    sum += felt.back();
  }
  if (felt.empty() || !(sum.norm() > 0.0)) return std::nullopt;

  // Up is their mean, its accuracy their spread.
  FeltUp up{sum.normalized(), 0.0};
  for (const Vector3d& f : felt) {
    const double angle = std::acos(std::clamp(f.normalized().dot(up.direction), -1.0, 1.0));
    up.spread_rad += angle / static_cast<double>(felt.size());
  }
  return up;
}

}  // namespace plumbline::inertial
