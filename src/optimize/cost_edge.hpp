// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// edge_rows (bundle_terms.hpp) as Ceres wants them.
#include <ceres/sized_cost_function.h>

#include "bundle_terms.hpp"
#include "manifolds.hpp"

namespace plumbline::optimize {

class EdgeCost : public ceres::SizedCostFunction<6, 7, 7> {
 public:
  explicit EdgeCost(const BundleEdge& edge) : view_(edge) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    EdgeDerivatives derivatives;
    Eigen::Map<geometry::Vector6d>(residuals).noalias() =
        edge_rows(view_, to_rigid(parameters[0]), to_rigid(parameters[1]),
                  jacobians != nullptr ? &derivatives : nullptr);
    if (jacobians == nullptr) return true;
    write(jacobians[0], derivatives.by_a);
    write(jacobians[1], derivatives.by_b);
    return true;
  }

 private:
  static void write(double* jacobian, const geometry::Matrix6d& local) {
    if (jacobian == nullptr) return;
    Eigen::Map<Eigen::Matrix<double, 6, 7, Eigen::RowMajor>> j(jacobian);
    j.leftCols<6>() = local;
    j.col(6).setZero();
  }

  EdgeView view_;
};

}  // namespace plumbline::optimize
