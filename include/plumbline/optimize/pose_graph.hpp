// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Pose graph: poses connected by relative measurements only, some of which may be wrong. Wrong edges are
// found by graduated non-convexity with a truncated quadratic (Yang, Antonante, Tzoumas, Carlone, RA-L 2020):
// least squares, by Ceres, with weights that go from nearly convex to 0 or 1. Plain structs in and out. Sums
// run in a fixed order: the same bytes each time.
#include <string>
#include <vector>

#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/optimize/bundle_adjustment.hpp"

namespace plumbline::optimize {

/// Measured b_from_a: xi = log(b_from_a_estimate * measured^-1), xi = (rho, phi) in metres and radians, has
/// this information. It may be singular: directions that the measurement does not constrain stay free.
struct GraphEdge {
  int a = -1;
  int b = -1;
  geometry::Rigid3 b_from_a;
  geometry::Matrix6d information = geometry::Matrix6d::Zero();
  bool trusted = false;  ///< odometry: never rejected
};

struct PoseGraph {
  std::vector<BundlePose> poses;
  std::vector<GraphEdge> edges;
};

/// Outcome of one edge.
struct EdgeVerdict {
  double chi2 = 0.0;    ///< squared error at the solution, in variances, whether the edge counted or not
  int dimensions = 0;   ///< directions that the edge constrains: rank of its information
  double weight = 1.0;  ///< 1: used; 0: rejected
  bool rejected = false;
};

struct PoseGraphSummary {
  double initial_cost = 0.0;  ///< half the sum of chi2 of all edges at the start
  double final_cost = 0.0;    ///< of the edges that count, at the solution
  int iterations = 0;         ///< of all solves
  int rounds = 0;
  int rejected = 0;
  std::vector<EdgeVerdict> edges;  ///< by edge
  bool usable = false;             ///< poses were updated
  std::string message;
};

/// Updates the poses that are not fixed. Parts of the graph that no edges tie to a fixed pose stay near where
/// they are. Edges to poses that do not exist, or from a pose to itself, throw std::invalid_argument; without
/// a fixed pose nothing is changed (usable = false, message says why). `robust`: wrong edges are rejected by
/// graduated non-convexity; else every edge counts.
PoseGraphSummary solve_pose_graph(PoseGraph& graph, bool robust = true);

/// Number of eigenvalues that are not negligible (at least 1e-9 of the largest one).
int rank_of(const geometry::Matrix6d& information);

/// Squared error that a measurement of `dimensions` (1-6) directions exceeds once in a thousand times.
double chi_square_gate(int dimensions);

}  // namespace plumbline::optimize
