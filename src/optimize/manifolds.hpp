// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Parameter blocks of bundle adjustment and how they are updated. The cost functions give their derivatives
// by the local coordinates directly, in the first columns of the ambient Jacobian; PlusJacobian = [I; 0]
// hands them on.
#include <ceres/manifold.h>

#include <array>

#include "plumbline/geometry/plucker.hpp"
#include "plumbline/geometry/rigid3.hpp"

namespace plumbline::optimize {

/// Quaternion x y z w, translation: camera_from_world.
using PoseBlock = std::array<double, 7>;
/// Quaternion x y z w of U, then w1 w2: an orthonormal line.
using LineBlock = std::array<double, 6>;

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
inline geometry::OrthonormalLine to_line(const double* block) {
  geometry::OrthonormalLine line;
  const Eigen::Map<const Eigen::Quaterniond> q(block);
  line.u = q.normalized().toRotationMatrix();
  line.w1 = block[4];
  line.w2 = block[5];
  return line;
}
inline void from_line(const geometry::OrthonormalLine& line, double* block) {
  Eigen::Map<Eigen::Quaterniond> q(block);
  q = Eigen::Quaterniond(line.u).normalized();
  block[4] = line.w1;
  block[5] = line.w2;
}

template <int kAmbient, int kTangent>
class LiftedManifold : public ceres::Manifold {
 public:
  int AmbientSize() const override { return kAmbient; }
  int TangentSize() const override { return kTangent; }
  bool PlusJacobian(const double* /*x*/, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, kAmbient, kTangent, Eigen::RowMajor>> j(jacobian);
    j.setIdentity();
    return true;
  }
  // Not used by the solvers that minimise; the lifted Jacobians have no meaning here.
  bool Minus(const double* /*y*/, const double* /*x*/, double* /*y_minus_x*/) const override { return false; }
  bool MinusJacobian(const double* /*x*/, double* /*jacobian*/) const override { return false; }
};

/// T <- Exp(delta) T.
class PoseManifold : public LiftedManifold<7, 6> {
 public:
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    const Eigen::Map<const geometry::Vector6d> xi(delta);
    from_rigid(geometry::exp_se3(xi) * to_rigid(x), x_plus_delta);
    return true;
  }
};

/// U <- U Exp(theta), W <- W R(phi).
class LineManifold : public LiftedManifold<6, 4> {
 public:
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    const Eigen::Map<const Eigen::Vector4d> d(delta);
    from_line(geometry::update(to_line(x), d), x_plus_delta);
    return true;
  }
};

}  // namespace plumbline::optimize
