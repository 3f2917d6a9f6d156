// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "plumbline/geometry/rigid3.hpp"

namespace plumbline::geometry {

/// T Exp(xi) T^-1 = Exp(adjoint(T) xi), xi = (rho, phi).
inline Matrix6d adjoint(const Rigid3& t) {
  Matrix6d a = Matrix6d::Zero();
  a.topLeftCorner<3, 3>() = t.rotation;
  a.bottomRightCorner<3, 3>() = t.rotation;
  a.topRightCorner<3, 3>() = skew(t.translation) * t.rotation;
  return a;
}

/// Information of (rho, phi) with equal standard deviations in all directions, metres and radians.
inline Matrix6d information_of(double sigma_m, double sigma_rad) {
  Vector6d diagonal;
  diagonal << Eigen::Vector3d::Constant(1.0 / (sigma_m * sigma_m)),
      Eigen::Vector3d::Constant(1.0 / (sigma_rad * sigma_rad));
  return diagonal.asDiagonal();
}

}  // namespace plumbline::geometry
