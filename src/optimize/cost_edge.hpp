// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// e = L^T log( T_b T_a^-1 Z^-1 ), Z the measured b_from_a, L L^T its information.
// With E = T_b T_a^-1 Z^-1 = Exp(e): left perturbations give Exp(xi_b) E and E Z Exp(-xi_a) Z^-1... so
// de/dxi_b = J_l^-1(e), de/dxi_a = -J_l^-1(e) Ad(T_b T_a^-1); J_l^-1 is taken to first order, I - ad(e)/2.
#include <ceres/sized_cost_function.h>

#include <Eigen/Eigenvalues>

#include "manifolds.hpp"
#include "plumbline/optimize/bundle_adjustment.hpp"

namespace plumbline::optimize {

inline geometry::Matrix6d adjoint(const geometry::Rigid3& t) {
  geometry::Matrix6d a = geometry::Matrix6d::Zero();
  a.topLeftCorner<3, 3>() = t.rotation;
  a.bottomRightCorner<3, 3>() = t.rotation;
  a.topRightCorner<3, 3>() = geometry::skew(t.translation) * t.rotation;
  return a;
}

/// L with L L^T = information, which may be singular: small and negative eigenvalues count as none.
inline geometry::Matrix6d square_root(const geometry::Matrix6d& information) {
  const Eigen::SelfAdjointEigenSolver<geometry::Matrix6d> eigen(information);
  const geometry::Vector6d roots = eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt();
  return eigen.eigenvectors() * roots.asDiagonal();
}

class EdgeCost : public ceres::SizedCostFunction<6, 7, 7> {
 public:
  explicit EdgeCost(const BundleEdge& edge)
      : a_from_b_(edge.b_from_a.inverse()), root_(square_root(edge.information).transpose()) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const geometry::Rigid3 a = to_rigid(parameters[0]);
    const geometry::Rigid3 b = to_rigid(parameters[1]);
    const geometry::Rigid3 b_from_a = b * a.inverse();
    const geometry::Vector6d e = geometry::log_se3(b_from_a * a_from_b_);
    Eigen::Map<geometry::Vector6d>(residuals).noalias() = root_ * e;
    if (jacobians == nullptr) return true;
    geometry::Matrix6d inverse_left = geometry::Matrix6d::Identity();
    const Eigen::Matrix3d rho = geometry::skew(e.head<3>());
    const Eigen::Matrix3d phi = geometry::skew(e.tail<3>());
    inverse_left.topLeftCorner<3, 3>() -= 0.5 * phi;
    inverse_left.topRightCorner<3, 3>() -= 0.5 * rho;
    inverse_left.bottomRightCorner<3, 3>() -= 0.5 * phi;
    const geometry::Matrix6d by_b = root_ * inverse_left;
    write(jacobians[1], by_b);
    if (jacobians[0] != nullptr) write(jacobians[0], -by_b * adjoint(b_from_a));
    return true;
  }

 private:
  static void write(double* jacobian, const geometry::Matrix6d& local) {
    if (jacobian == nullptr) return;
    Eigen::Map<Eigen::Matrix<double, 6, 7, Eigen::RowMajor>> j(jacobian);
    j.leftCols<6>() = local;
    j.col(6).setZero();
  }

  geometry::Rigid3 a_from_b_;
  geometry::Matrix6d root_;
};

}  // namespace plumbline::optimize
