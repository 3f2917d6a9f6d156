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

}  // namespace plumbline::geometry
