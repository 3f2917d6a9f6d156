// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// 3D lines in Pluecker and orthonormal form (docs/method/least_squares.md).
#include <Eigen/Core>

#include "plumbline/geometry/rigid3.hpp"

namespace plumbline::geometry {

/// L = (n, v): v the direction, n = p x v for any point p of the line; n.v = 0. Metres.
struct PluckerLine {
  Eigen::Vector3d n = Eigen::Vector3d::Zero();
  Eigen::Vector3d v = Eigen::Vector3d::UnitX();
};

/// Line through two points, v of unit length. The points must differ.
PluckerLine line_through(const Eigen::Vector3d& a, const Eigen::Vector3d& b);

/// n_t = R n_s + [t]x R v_s, v_t = R v_s.
PluckerLine transform(const Rigid3& target_from_source, const PluckerLine& source);

/// Point of the line nearest to `p`.
Eigen::Vector3d nearest_point(const PluckerLine& line, const Eigen::Vector3d& p);

/// K_L: image line l = K_L n_c, with l.(u, v, 1) = 0 for pixels on it.
Eigen::Matrix3d line_projection(double fx, double fy, double cx, double cy);

/// Orthonormal form: U = [n/|n|, v/|v|, nxv/|nxv|], W the rotation of angle atan2(|v|, |n|). 4 degrees of
/// freedom.
struct OrthonormalLine {
  Eigen::Matrix3d u = Eigen::Matrix3d::Identity();
  double w1 = 0.0;  ///< W11 = |n| / sqrt(|n|^2 + |v|^2)
  double w2 = 1.0;  ///< W21 = |v| / sqrt(|n|^2 + |v|^2)
};

/// For a line through the origin, with n = 0, any n perpendicular to v is used.
OrthonormalLine to_orthonormal(const PluckerLine& line);
/// Up to scale; v is made unit length.
PluckerLine to_plucker(const OrthonormalLine& line);

/// U <- U Exp(theta), W <- W R(phi); delta = (theta, phi), radians.
OrthonormalLine update(const OrthonormalLine& line, const Eigen::Vector4d& delta);

/// d(n, v)/d(theta, phi) of the unscaled vector (w1 u1, w2 u2).
Eigen::Matrix<double, 6, 4> orthonormal_jacobian(const OrthonormalLine& line);

}  // namespace plumbline::geometry
