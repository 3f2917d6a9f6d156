// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/geometry/rigid3.hpp"

#include <cmath>

namespace plumbline::geometry {
namespace {

/// One Newton step towards the nearest rotation: R (3 I - R^T R) / 2; enough for rounding errors.
Eigen::Matrix3d renormalised(const Eigen::Matrix3d& r) {
  return r * (1.5 * Eigen::Matrix3d::Identity() - 0.5 * (r.transpose() * r));
}

/// Left Jacobian of SO(3): translation of Exp(rho, phi) is V(phi) rho.
Eigen::Matrix3d left_jacobian(const Eigen::Vector3d& phi) {
  const double angle_sq = phi.squaredNorm();
  const Eigen::Matrix3d k = skew(phi);
  if (angle_sq < 1e-10) return Eigen::Matrix3d::Identity() + 0.5 * k + k * k / 6.0;
  const double angle = std::sqrt(angle_sq);
  return Eigen::Matrix3d::Identity() + (1.0 - std::cos(angle)) / angle_sq * k +
         (angle - std::sin(angle)) / (angle_sq * angle) * (k * k);
}

}  // namespace

Eigen::Quaterniond Rigid3::quaternion() const {
  Eigen::Quaterniond q(rotation);
  q.normalize();
  if (q.w() < 0.0) q.coeffs() = -q.coeffs();
  return q;
}

Eigen::Isometry3d Rigid3::isometry() const {
  Eigen::Isometry3d t = Eigen::Isometry3d::Identity();
  t.linear() = rotation;
  t.translation() = translation;
  return t;
}

Rigid3 Rigid3::operator*(const Rigid3& b) const {
  return {renormalised(rotation * b.rotation), rotation * b.translation + translation};
}

Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

Eigen::Matrix3d exp_so3(const Eigen::Vector3d& phi) {
  const double angle = phi.norm();
  if (angle < 1e-12) return renormalised(Eigen::Matrix3d::Identity() + skew(phi));
  return Eigen::AngleAxisd(angle, phi / angle).toRotationMatrix();
}

Eigen::Vector3d log_so3(const Eigen::Matrix3d& rotation) {
  Eigen::Quaterniond q(rotation);
  q.normalize();

  // The shorter of both rotations.
  if (q.w() < 0.0) q.coeffs() = -q.coeffs();
  const double n = q.vec().norm();
  if (n < 1e-12) return 2.0 * q.vec();
  return 2.0 * std::atan2(n, q.w()) / n * q.vec();
}

double rotation_angle(const Eigen::Matrix3d& rotation) { return log_so3(rotation).norm(); }

Rigid3 exp_se3(const Vector6d& xi) {
  const Eigen::Vector3d phi = xi.tail<3>();
  return {exp_so3(phi), left_jacobian(phi) * xi.head<3>()};
}

Vector6d log_se3(const Rigid3& transform) {
  Vector6d xi;
  const Eigen::Vector3d phi = log_so3(transform.rotation);
  xi.head<3>() = left_jacobian(phi).partialPivLu().solve(transform.translation);
  xi.tail<3>() = phi;
  return xi;
}

Rigid3 interpolate(const Rigid3& a, const Rigid3& b, double s) {
  return {a.quaternion().slerp(s, b.quaternion()), (1.0 - s) * a.translation + s * b.translation};
}

}  // namespace plumbline::geometry
