// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Least-squares collocation (Moritz, Advanced Physical Geodesy, 1980): observations of a few parameters and
// of a signal whose covariance is known, here a similarity and how a map bends.
#include <Eigen/Core>
#include <vector>

namespace plumbline::adjust {

/// r = g q + signal + noise. All rows of one group are of one observation.
struct CollocationProblem {
  Eigen::VectorXd r;
  Eigen::MatrixXd g;            ///< as many rows as r
  Eigen::MatrixXd covariance;   ///< of signal and noise together; positive definite
  Eigen::VectorXd prior_sigma;  ///< of q, about 0
  std::vector<int> rows;        ///< of each observation, in order
};

/// Comparison of one observation with the prediction of all others.
struct CollocationCheck {
  double chi2 = 0.0;  ///< squared difference from what they predict, in variances
  int rows = 0;
  Eigen::VectorXd difference;  ///< observed less predicted
  double sigma = 0.0;          ///< standard deviation of the difference where it is known worst
};

struct CollocationSolution {
  Eigen::VectorXd q;
  Eigen::MatrixXd q_covariance;
  Eigen::VectorXd weights;  ///< the signal anywhere is its covariance with the rows times these
  std::vector<CollocationCheck> checks;
};

CollocationSolution solve_collocation(const CollocationProblem& problem);

}  // namespace plumbline::adjust
