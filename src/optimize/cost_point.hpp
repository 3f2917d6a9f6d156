// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// e = ( (u - pi(T P)) / sigma, (z - (T P)_z) / sigma_z ); the third row is 0 without depth.
#include <ceres/sized_cost_function.h>

#include "manifolds.hpp"
#include "plumbline/optimize/pose_terms.hpp"

namespace plumbline::optimize {

class PointCost : public ceres::SizedCostFunction<3, 7, 3> {
 public:
  PointCost(const PointTerm& term, const sensor::Pinhole& camera) : term_(term), camera_(camera) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const geometry::Rigid3 pose = to_rigid(parameters[0]);
    PointTerm term = term_;
    term.world = Eigen::Map<const Eigen::Vector3d>(parameters[1]);
    Eigen::Vector3d r;
    Eigen::Matrix<double, 3, 6> j;
    const int rows = point_residual(term, pose, camera_, r, jacobians != nullptr ? &j : nullptr);
    Eigen::Map<Eigen::Vector3d> residual(residuals);
    if (rows == 0) {  // behind the camera: a constant, large error that the gate takes for an outlier
      residual = Eigen::Vector3d(1e3, 1e3, 0.0);
      j.setZero();
    } else {
      residual = r;
    }
    if (jacobians == nullptr) return true;
    if (jacobians[0] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 3, 7, Eigen::RowMajor>> pose_jacobian(jacobians[0]);
      pose_jacobian.leftCols<6>() = j;
      pose_jacobian.col(6).setZero();
    }
    if (jacobians[1] != nullptr) {  // de/dP = de/drho R
      Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> point_jacobian(jacobians[1]);
      point_jacobian = j.leftCols<3>() * pose.rotation;
    }
    return true;
  }

 private:
  PointTerm term_;
  sensor::Pinhole camera_;
};

}  // namespace plumbline::optimize
