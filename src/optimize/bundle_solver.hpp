// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// One round of bundle adjustment: Levenberg-Marquardt on poses, points and lines. Landmarks are eliminated
// first; what is left couples poses that share some (Triggs et al., Bundle Adjustment: A Modern Synthesis,
// 2000), and is factored as a sparse matrix of blocks. Step control is Ceres's: trust region radius, damping
// and ends of iterations mean the same. Work is cut by pose or by landmark, each sum belongs to one of them
// and runs in one order: the same bytes for any number of threads.
#include <memory>
#include <string>
#include <vector>

#include "plumbline/core/crew.hpp"
#include "plumbline/optimize/bundle_adjustment.hpp"

namespace plumbline::optimize {

/// What is solved for. Lines are kept as the solver turns them.
struct BundleState {
  std::vector<geometry::Rigid3> poses;  ///< camera_from_world
  std::vector<Eigen::Vector3d> points;
  std::vector<geometry::OrthonormalLine> lines;
};

struct RoundSummary {
  double initial_cost = 0.0;
  double final_cost = 0.0;
  int iterations = 0;
  bool usable = false;  ///< the state was improved, or there was nothing to improve
  std::string message;
};

/// Improves `state`; leaves out what the problem calls outliers, and landmarks that a single pose sees
/// without depth.
RoundSummary solve_bundle_round(const BundleProblem& problem, const BundleOptions& options, core::Crew& crew,
                                BundleState& state);

}  // namespace plumbline::optimize
