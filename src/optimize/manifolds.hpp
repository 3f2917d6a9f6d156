// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Poses as Ceres' parameter blocks, and how they are updated. The cost functions give their derivatives by
// the local coordinates directly, in the first columns of the ambient Jacobian; PlusJacobian = [I; 0] hands
// them on.
#include <ceres/manifold.h>

#include <array>

#include "plumbline/geometry/rigid3.hpp"

namespace plumbline::optimize {

/// Quaternion x y z w, translation: camera_from_world.
using PoseBlock = std::array<double, 7>;

inline geometry::Rigid3 to_rigid(const double* block) {
  const Eigen::Map<const Eigen::Quaterniond> q(block);
  return {q.normalized().toRotationMatrix(), Eigen::Vector3d(block[4], block[5], block[6])};
}
inline void from_rigid(const geometry::Rigid3& pose, double* block) {
  Eigen::Map<Eigen::Quaterniond> q(block);
  q = pose.quaternion();
  block[4] = pose.translation.x();
  block[5] = pose.translation.y();
  block[6] = pose.translation.z();
}

/// T <- Exp(delta) T.
class PoseManifold : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    const Eigen::Map<const geometry::Vector6d> xi(delta);
    from_rigid(geometry::exp_se3(xi) * to_rigid(x), x_plus_delta);
    return true;
  }
  bool PlusJacobian(const double* /*x*/, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 7, 6, Eigen::RowMajor>> j(jacobian);
    j.setIdentity();
    return true;
  }
  // Not used by the solvers that minimise; the lifted Jacobians have no meaning here.
  bool Minus(const double* /*y*/, const double* /*x*/, double* /*y_minus_x*/) const override { return false; }
  bool MinusJacobian(const double* /*x*/, double* /*jacobian*/) const override { return false; }
};

}  // namespace plumbline::optimize
