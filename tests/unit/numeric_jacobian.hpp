// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Central differences, to hold analytic derivatives against.
#include <Eigen/Core>

namespace plumbline::tests {

/// d f / d x at 0 for f: R^C -> R^R given as vectors.
template <int R, int C, typename Function>
Eigen::Matrix<double, R, C> numeric_jacobian(const Function& f, double step = 1e-6) {
  Eigen::Matrix<double, R, C> j;
  for (int i = 0; i < C; ++i) {
    Eigen::Matrix<double, C, 1> x = Eigen::Matrix<double, C, 1>::Zero();
    x(i) = step;
    const Eigen::Matrix<double, R, 1> after = f(x);
    x(i) = -step;
    const Eigen::Matrix<double, R, 1> before = f(x);
    j.col(i) = (after - before) / (2.0 * step);
  }
  return j;
}

}  // namespace plumbline::tests
