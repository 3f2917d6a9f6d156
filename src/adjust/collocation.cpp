// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/adjust/collocation.hpp"

#include <Eigen/Cholesky>
#include <cmath>

namespace plumbline::adjust {

CollocationSolution solve_collocation(const CollocationProblem& problem) {
  const Eigen::Index count = problem.r.size();
  const Eigen::MatrixXd inverse =
      problem.covariance.ldlt().solve(Eigen::MatrixXd::Identity(count, count).eval());

  // Unknowns by generalised least squares, then the observations' weights with them taken out.
  CollocationSolution solution;
  const Eigen::MatrixXd weighted = inverse * problem.g;
  Eigen::MatrixXd normal = problem.g.transpose() * weighted;
  normal.diagonal() += problem.prior_sigma.cwiseAbs2().cwiseInverse();
  solution.q_covariance = normal.ldlt().solve(Eigen::MatrixXd::Identity(normal.rows(), normal.cols()).eval());
  const Eigen::MatrixXd reduced = inverse - weighted * solution.q_covariance * weighted.transpose();

  solution.q = solution.q_covariance * (weighted.transpose() * problem.r);
  solution.weights = reduced * problem.r;

  // Each observation against the prediction of all others, in closed form.
  Eigen::Index first = 0;
  for (const int rows : problem.rows) {
    const Eigen::MatrixXd own = reduced.block(first, first, rows, rows);
    const Eigen::MatrixXd spread = own.ldlt().solve(Eigen::MatrixXd::Identity(rows, rows).eval());

    CollocationCheck& check = solution.checks.emplace_back();
    check.rows = rows;
    check.difference = spread * solution.weights.segment(first, rows);
    check.chi2 = solution.weights.segment(first, rows).dot(check.difference);
    check.sigma = std::sqrt(spread.diagonal().maxCoeff());
    first += rows;
  }

  return solution;
}

}  // namespace plumbline::adjust
