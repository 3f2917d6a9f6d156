// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/optimize/pose_graph.hpp"

#include <ceres/ceres.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <stdexcept>

#include "ceres_solve.hpp"
#include "ceres_terms.hpp"

namespace plumbline::optimize {
namespace {

constexpr double kTolerance = 1e-7;       // of a solve with final weights
constexpr double kRoughTolerance = 1e-2;  // of one on the way there
constexpr int kRoughIterations = 3;
constexpr int kMostIterations = 30;   // of each least-squares solve
constexpr int kMostRounds = 60;       // solves with changed weights
constexpr double kRoundFactor = 1.6;  // how fast the loss turns from convex to truncated

/// Information that holds every free pose at its present value with 30 m and 30 rad: negligible beside a
/// measurement, but enough for directions that no edge constrains.
constexpr double kWeakInformation = 1e-3;

/// The graph as a problem for Ceres, with a weight for each edge that may change between solves. All poses
/// are in one array, so that the order of sums does not depend on the heap; the last one is the world.
class Solver {
 public:
  explicit Solver(const PoseGraph& graph) : graph_(graph), numbers_(kPoseBlock * (graph.poses.size() + 1)) {
    const std::size_t world = graph.poses.size();
    for (std::size_t i = 0; i <= world; ++i) {
      from_rigid(i < world ? graph.poses[i].camera_from_world : geometry::Rigid3(), block(i));
      ceres_.AddParameterBlock(block(i), kPoseBlock, &manifold_);
      if (i == world || graph.poses[i].fixed) ceres_.SetParameterBlockConstant(block(i));
    }
    for (const GraphEdge& edge : graph.edges) {
      losses_.push_back(std::make_unique<ceres::LossFunctionWrapper>(nullptr, ceres::TAKE_OWNERSHIP));
      add({edge.a, edge.b, edge.b_from_a, edge.information}, losses_.back().get(), block(edge.a));
    }
    for (std::size_t i = 0; i < world; ++i) {
      const geometry::Matrix6d hold = kWeakInformation * geometry::Matrix6d::Identity();
      if (!graph.poses[i].fixed)
        add({-1, static_cast<int>(i), graph.poses[i].camera_from_world, hold}, nullptr, block(world));
    }
  }

  void set_weight(std::size_t edge, double weight) {
    losses_[edge]->Reset(new ceres::ScaledLoss(nullptr, weight, ceres::TAKE_OWNERSHIP),
                         ceres::TAKE_OWNERSHIP);
  }

  /// Solves from the present poses. Ends if an iteration lowers the cost by a smaller share than `tolerance`.
  ceres::Solver::Summary solve(int max_iterations, double tolerance) {
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
    options.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;
    options.max_num_iterations = max_iterations;
    options.initial_trust_region_radius = 1e8;  // relative poses are nearly linear: hardly damped
    options.function_tolerance = tolerance;
    options.parameter_tolerance = 1e-9;
    return optimize::solve(std::move(options), ceres_);
  }

  /// Squared error of an edge as the poses are now, without its weight.
  [[nodiscard]] double chi2(std::size_t edge) const {
    const GraphEdge& e = graph_.edges[edge];
    const geometry::Rigid3 b_from_a =
        pose(static_cast<std::size_t>(e.b)) * pose(static_cast<std::size_t>(e.a)).inverse();
    const geometry::Vector6d xi = geometry::log_se3(b_from_a * e.b_from_a.inverse());
    return std::max(0.0, xi.dot(e.information * xi));
  }
  [[nodiscard]] geometry::Rigid3 pose(std::size_t i) const {
    return to_rigid(numbers_.data() + kPoseBlock * i);
  }

 private:
  double* block(std::size_t i) { return numbers_.data() + kPoseBlock * i; }
  double* block(int i) { return block(static_cast<std::size_t>(i)); }
  void add(const BundleEdge& edge, ceres::LossFunction* loss, double* a) {
    ceres_.AddResidualBlock(new EdgeCost(edge), loss, a, block(edge.b));
  }

  const PoseGraph& graph_;
  std::vector<double> numbers_;
  PoseManifold manifold_;
  std::vector<std::unique_ptr<ceres::LossFunctionWrapper>> losses_;  ///< of each edge
  ceres::Problem ceres_{borrowing()};
};

/// Weight of a truncated quadratic that is mu away from convex (0) and from truncated (infinity); `ratio` is
/// the squared error over the gate. Equation 14 of the paper.
double graduated_weight(double ratio, double mu) {
  if (ratio >= (mu + 1.0) / mu) return 0.0;
  if (ratio <= mu / (mu + 1.0)) return 1.0;
  return std::clamp(std::sqrt(mu * (mu + 1.0) / ratio) - mu, 0.0, 1.0);
}

/// Least squares again and again, with weights that turn into 0 and 1.
class Graduated {
 public:
  Graduated(const PoseGraph& graph, Solver& solver, PoseGraphSummary& summary)
      : graph_(graph), solver_(solver), summary_(summary) {
    for (std::size_t i = 0; i < graph.edges.size(); ++i) {
      gates_.push_back(chi_square_gate(std::max(1, summary.edges[i].dimensions)));
    }
  }

  /// The weights start from where the poses are, not from a least-squares solve that wrong edges have already
  /// torn. Returns false when a solve failed.
  bool run() {
    double worst = 1.0;
    for (std::size_t i = 0; i < gates_.size(); ++i) {
      if (!graph_.edges[i].trusted) worst = std::max(worst, ratio(i));
    }
    double mu = worst > 1.0 ? 1.0 / (2.0 * worst - 1.0) : 1e6;
    for (int round = 0; round < kMostRounds; ++round) {
      const bool decided = set_weights(mu);
      const ceres::Solver::Summary solved = decided ? solver_.solve(kMostIterations, kTolerance)
                                                    : solver_.solve(kRoughIterations, kRoughTolerance);
      ++summary_.rounds;
      summary_.iterations += static_cast<int>(solved.iterations.size());
      summary_.message = solved.message;
      if (!solved.IsSolutionUsable()) return false;
      if (decided && !set_weights(mu, true)) break;
      mu *= kRoundFactor;
    }
    return true;
  }

 private:
  [[nodiscard]] double ratio(std::size_t i) const { return solver_.chi2(i) / gates_[i]; }

  /// Returns whether all weights are 0 or 1; with `compare` only whether any of them would change.
  bool set_weights(double mu, bool compare = false) {
    bool decided = true;
    bool changed = false;
    for (std::size_t i = 0; i < gates_.size(); ++i) {
      if (graph_.edges[i].trusted) continue;
      const double weight = graduated_weight(ratio(i), mu);
      decided = decided && (weight < 1e-3 || weight > 1.0 - 1e-3);
      double& current = summary_.edges[i].weight;
      changed = changed || std::abs(weight - current) > 1e-3;
      if (compare) continue;
      current = weight;
      solver_.set_weight(i, weight);
    }
    return compare ? changed : decided;
  }

  const PoseGraph& graph_;
  Solver& solver_;
  PoseGraphSummary& summary_;
  std::vector<double> gates_;
};

// Throws if an edge does not join two different poses.
void check(const PoseGraph& graph) {
  const auto count = static_cast<int>(graph.poses.size());
  for (const GraphEdge& edge : graph.edges) {
    if (edge.a < 0 || edge.b < 0 || edge.a >= count || edge.b >= count || edge.a == edge.b) {
      throw std::invalid_argument("solve_pose_graph: an edge must join two poses of the graph");
    }
  }
}

}  // namespace

int rank_of(const geometry::Matrix6d& information) {
  const Eigen::SelfAdjointEigenSolver<geometry::Matrix6d> eigen(information, Eigen::EigenvaluesOnly);
  const double largest = eigen.eigenvalues()(5);
  return largest > 0.0 ? static_cast<int>((eigen.eigenvalues().array() > 1e-9 * largest).count()) : 0;
}

double chi_square_gate(int dimensions) {
  if (dimensions < 1 || dimensions > 6) throw std::invalid_argument("chi_square_gate: 1 to 6 dimensions");
  static constexpr std::array<double, 6> kGates{10.828, 13.816, 16.266, 18.467, 20.515, 22.458};
  return kGates[static_cast<std::size_t>(dimensions - 1)];
}

PoseGraphSummary solve_pose_graph(PoseGraph& graph, bool robust) {
  check(graph);
  PoseGraphSummary summary;
  if (std::none_of(graph.poses.begin(), graph.poses.end(), [](const BundlePose& p) { return p.fixed; })) {
    summary.message = "no pose is fixed: the solution would float";
    return summary;
  }

  // Dimensions and initial cost of the edges
  Solver solver(graph);
  summary.edges.resize(graph.edges.size());
  for (std::size_t i = 0; i < graph.edges.size(); ++i) {
    summary.edges[i].dimensions = rank_of(graph.edges[i].information);
    summary.initial_cost += 0.5 * solver.chi2(i);
  }

  // Graduated non-convexity, or plain least squares
  if (robust) {
    if (!Graduated(graph, solver, summary).run()) return summary;
  } else {
    const ceres::Solver::Summary solved = solver.solve(kMostIterations, kTolerance);
    summary.rounds = 1;
    summary.iterations = static_cast<int>(solved.iterations.size());
    summary.message = solved.message;
    if (!solved.IsSolutionUsable()) return summary;
  }

  // Edges of small weight are rejected
  for (std::size_t i = 0; i < graph.edges.size(); ++i) {
    EdgeVerdict& verdict = summary.edges[i];
    verdict.chi2 = solver.chi2(i);
    verdict.rejected = verdict.weight < 0.5;
    summary.rejected += verdict.rejected ? 1 : 0;
    if (!verdict.rejected) summary.final_cost += 0.5 * verdict.chi2;
  }

  for (std::size_t i = 0; i < graph.poses.size(); ++i) {
    if (!graph.poses[i].fixed) graph.poses[i].camera_from_world = solver.pose(i);
  }

  summary.usable = true;
  return summary;
}

}  // namespace plumbline::optimize
