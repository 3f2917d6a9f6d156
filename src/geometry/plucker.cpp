// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/geometry/plucker.hpp"

#include <cmath>

namespace plumbline::geometry {

PluckerLine line_through(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d v = (b - a).normalized();
  return {a.cross(v), v};
}

PluckerLine transform(const Rigid3& target_from_source, const PluckerLine& source) {
  const Eigen::Vector3d v = target_from_source.rotation * source.v;
  return {target_from_source.rotation * source.n + target_from_source.translation.cross(v), v};
}

Eigen::Vector3d nearest_point(const PluckerLine& line, const Eigen::Vector3d& p) {
  const double vv = line.v.squaredNorm();
  const Eigen::Vector3d foot = line.v.cross(line.n) / vv;  // point nearest to the origin
  return foot + line.v * (line.v.dot(p - foot) / vv);
}

Eigen::Matrix3d line_projection(double fx, double fy, double cx, double cy) {
  Eigen::Matrix3d k;
  k << fy, 0.0, 0.0, 0.0, fx, 0.0, -fy * cx, -fx * cy, fx * fy;
  return k;
}

OrthonormalLine to_orthonormal(const PluckerLine& line) {
  OrthonormalLine result;
  const double n_norm = line.n.norm();
  const double v_norm = line.v.norm();
  const Eigen::Vector3d v = line.v / v_norm;

  // A line through the origin has no normal.
  Eigen::Vector3d n = n_norm > 1e-12 * v_norm ? Eigen::Vector3d(line.n / n_norm) : v.unitOrthogonal();
  n = (n - v * v.dot(n)).normalized();
  result.u.col(0) = n;
  result.u.col(1) = v;
  result.u.col(2) = n.cross(v);
  const double scale = std::hypot(n_norm, v_norm);
  result.w1 = n_norm / scale;
  result.w2 = v_norm / scale;
  return result;
}

PluckerLine to_plucker(const OrthonormalLine& line) {
  const double sign = line.w2 < 0.0 ? -1.0 : 1.0;
  const double v_norm = std::abs(line.w2);
  if (v_norm < 1e-15) return {line.u.col(0) * (line.w1 / 1e-15), line.u.col(1)};  // a line at infinity
  return {line.u.col(0) * (line.w1 / v_norm), sign * line.u.col(1)};
}

OrthonormalLine update(const OrthonormalLine& line, const Eigen::Vector4d& delta) {
  OrthonormalLine result;
  result.u = line.u * exp_so3(delta.head<3>());
  const double c = std::cos(delta(3));
  const double s = std::sin(delta(3));
  result.w1 = line.w1 * c - line.w2 * s;
  result.w2 = line.w2 * c + line.w1 * s;

  // Rounding must not build up.
  const double norm = std::hypot(result.w1, result.w2);
  result.w1 /= norm;
  result.w2 /= norm;
  return result;
}

Eigen::Matrix<double, 6, 4> orthonormal_jacobian(const OrthonormalLine& line) {
  // Columns: rotation about u1, u2 and u3, then the angle.
  Eigen::Matrix<double, 6, 4> j = Eigen::Matrix<double, 6, 4>::Zero();
  const auto u1 = line.u.col(0);
  const auto u2 = line.u.col(1);
  const auto u3 = line.u.col(2);
  j.block<3, 1>(0, 1) = -line.w1 * u3;
  j.block<3, 1>(0, 2) = line.w1 * u2;
  j.block<3, 1>(0, 3) = -line.w2 * u1;
  j.block<3, 1>(3, 0) = line.w2 * u3;
  j.block<3, 1>(3, 2) = -line.w2 * u1;
  j.block<3, 1>(3, 3) = line.w1 * u2;
  return j;
}

}  // namespace plumbline::geometry
