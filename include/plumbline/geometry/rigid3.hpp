// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Rigid transforms on SE(3). Variables read target_from_source: p_target = target_from_source * p_source.
#include <Eigen/Core>
#include <Eigen/Geometry>

namespace plumbline::geometry {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// Rotation and translation, metres. The rotation is kept orthonormal by every operation here.
struct Rigid3 {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Rigid3() = default;
  Rigid3(const Eigen::Matrix3d& r, const Eigen::Vector3d& t) : rotation(r), translation(t) {}
  Rigid3(const Eigen::Quaterniond& q, const Eigen::Vector3d& t)
      : rotation(q.normalized().toRotationMatrix()), translation(t) {}

  [[nodiscard]] Rigid3 inverse() const {
    return {rotation.transpose(), -(rotation.transpose() * translation)};
  }
  [[nodiscard]] Eigen::Quaterniond quaternion() const;  ///< unit, w >= 0
  [[nodiscard]] Eigen::Isometry3d isometry() const;
  Eigen::Vector3d operator*(const Eigen::Vector3d& p) const { return rotation * p + translation; }
  Rigid3 operator*(const Rigid3& b) const;  ///< chained products are renormalised
};

Eigen::Matrix3d skew(const Eigen::Vector3d& v);  ///< [v]x, so that skew(v) * u == v.cross(u)

/// Exponential map, xi = (rho, phi): metres, radians. Left perturbation T <- Exp(xi) T.
Rigid3 exp_se3(const Vector6d& xi);
Vector6d log_se3(const Rigid3& transform);
Eigen::Matrix3d exp_so3(const Eigen::Vector3d& phi);
Eigen::Vector3d log_so3(const Eigen::Matrix3d& rotation);  ///< angle in [0, pi]
double rotation_angle(const Eigen::Matrix3d& rotation);    ///< radians, [0, pi]

/// Interpolates linearly in translation, by slerp in rotation; s = 0 gives a, s = 1 gives b.
Rigid3 interpolate(const Rigid3& a, const Rigid3& b, double s);

}  // namespace plumbline::geometry
