// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// One round of bundle adjustment: Levenberg-Marquardt on poses, points and lines. Landmarks are eliminated
// first; the remaining system couples poses that share some (Triggs et al., Bundle Adjustment: A Modern
// Synthesis, 2000). Solved by our own solver, which is faster if there are few poses (a window beside the
// tracker), or by Ceres. Trust region, damping, losses and ends of iterations mean the same in both.
#include <string>
#include <vector>

#include "plumbline/optimize/bundle_adjustment.hpp"

namespace plumbline::optimize {

/// Unknowns of the solver. Lines are in its own parametrisation.
struct BundleState {
  std::vector<geometry::Rigid3> poses;  ///< camera_from_world
  std::vector<Eigen::Vector3d> points;
  std::vector<geometry::OrthonormalLine> lines;
};

BundleState state_of(const BundleProblem& problem);

struct RoundSummary {
  double initial_cost = 0.0;
  double final_cost = 0.0;
  int iterations = 0;
  bool usable = false;  ///< the state was improved, or there was nothing to improve
  std::string message;
};

/// Improves `state`; leaves out what the problem calls outliers, and landmarks that a single pose sees
/// without depth.
RoundSummary solve_bundle_round(const BundleProblem& problem, const BundleOptions& options,
                                BundleState& state);
/// The same by Ceres.
RoundSummary solve_map_round(const BundleProblem& problem, const BundleOptions& options, BundleState& state);

/// Observations that take part in a round, by number.
struct UsedObservations {
  explicit UsedObservations(const BundleProblem& problem);
  std::vector<int> points;
  std::vector<int> lines;
};

/// Edges from the world (a = -1) to each pose that edges hold, with 1 m and 1 rad: far weaker than any
/// measurement, but directions that an edge leaves free would otherwise run off (damping scales each unknown
/// by its information, and so prefers to move along them).
std::vector<BundleEdge> holding_edges(const BundleProblem& problem, const BundleState& state);

}  // namespace plumbline::optimize
