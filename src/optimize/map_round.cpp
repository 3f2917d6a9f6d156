// SPDX-License-Identifier: BSD-3-Clause
// A round of bundle adjustment by Ceres.

#include <ceres/ceres.h>

#include <algorithm>
#include <numeric>
#include <utility>

#include "bundle_solver.hpp"
#include "ceres_solve.hpp"
#include "ceres_terms.hpp"

namespace plumbline::optimize {
namespace {

/// Converts the state to Ceres' parameter blocks and back. All are in one array: within an elimination group
/// Ceres orders blocks by address, so with separate arrays of points and lines the order of its sums, and
/// thus the last digits of the result, would depend on the heap.
class MapUnknowns {
 public:
  explicit MapUnknowns(const BundleState& state) : poses_(state.poses.size()), points_(state.points.size()) {
    numbers_.resize(kPoseBlock * (poses_ + 1) + 3 * points_ + kLineBlock * state.lines.size());
    for (std::size_t i = 0; i < poses_; ++i) from_rigid(state.poses[i], pose(i));
    from_rigid({}, world());
    for (std::size_t i = 0; i < points_; ++i) std::copy_n(state.points[i].data(), 3, point(i));
    for (std::size_t i = 0; i < state.lines.size(); ++i) from_line(state.lines[i], line(i));
  }
  double* pose(std::size_t i) { return numbers_.data() + kPoseBlock * i; }
  double* pose(int i) { return i < 0 ? world() : pose(static_cast<std::size_t>(i)); }
  double* world() { return pose(poses_); }  ///< pose -1, from which edges to the world begin
  double* point(std::size_t i) { return pose(poses_ + 1) + 3 * i; }
  double* line(std::size_t i) { return point(points_) + kLineBlock * i; }

  void write_back(const BundleProblem& problem, BundleState& state) {
    for (std::size_t i = 0; i < poses_; ++i) {
      if (!problem.poses[i].fixed) state.poses[i] = to_rigid(pose(i));
    }
    for (std::size_t i = 0; i < points_; ++i) state.points[i] = Eigen::Vector3d(point(i));
    for (std::size_t i = 0; i < state.lines.size(); ++i) state.lines[i] = to_line(line(i));
  }

 private:
  std::size_t poses_;
  std::size_t points_;
  std::vector<double> numbers_;
};

/// The round as a problem for Ceres, with the order of elimination.
class MapRound {
 public:
  MapRound(const BundleProblem& problem, const BundleOptions& options, BundleState& state)
      : problem_(problem),
        options_(options),
        state_(state),
        unknowns_(state),
        point_loss_(options.point_loss),
        line_loss_(options.line_loss),
        edge_loss_(options.edge_loss),
        ceres_(borrowing()) {
    add_poses();
    add_observations();
    for (const BundleEdge& edge : problem.edges) add(edge, &edge_loss_);
    for (const BundleEdge& stay : holding_edges(problem, state)) add(stay, nullptr);
  }

  RoundSummary solve() {
    // Dense equations are faster for few poses
    constexpr std::size_t kMostDense = 100;  // poses
    ceres::Solver::Options solver;
    solver.linear_solver_type =
        problem_.poses.size() <= kMostDense ? ceres::DENSE_SCHUR : ceres::SPARSE_SCHUR;
    solver.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;
    solver.linear_solver_ordering = ordering_;
    solver.max_num_iterations = options_.max_iterations;
    solver.initial_trust_region_radius = options_.first_radius;
    solver.function_tolerance = options_.tolerance;
    solver.parameter_tolerance = 1e-7;

    double cost = 0.0;
    if (!ceres_.Evaluate({}, &cost, nullptr, nullptr, nullptr))  // otherwise Ceres would print an error
      return {0.0, 0.0, 0, false, "the cost is not a number, because an observation or a pose is not"};

    const ceres::Solver::Summary solved = optimize::solve(std::move(solver), ceres_);
    if (!solved.IsSolutionUsable()) return {0.0, 0.0, 0, false, solved.message};
    unknowns_.write_back(problem_, state_);
    return {solved.initial_cost, solved.final_cost, static_cast<int>(solved.iterations.size()), true,
            solved.message};
  }

 private:
  void add_poses() {
    for (std::size_t i = 0; i <= problem_.poses.size(); ++i) {  // the world last
      ceres_.AddParameterBlock(unknowns_.pose(i), kPoseBlock, &pose_manifold_);

      // The world and fixed poses are constants
      if (i == problem_.poses.size() || problem_.poses[i].fixed)
        ceres_.SetParameterBlockConstant(unknowns_.pose(i));
      ordering_->AddElementToGroup(unknowns_.pose(i), 1);
    }
  }
  void add_observations() {
    const UsedObservations used(problem_);

    // Landmarks are eliminated before the poses
    for (const int i : used.points) {
      const BundlePointObservation& o = problem_.point_observations[static_cast<std::size_t>(i)];
      double* point = unknowns_.point(static_cast<std::size_t>(o.point));
      ceres_.AddResidualBlock(new PointCost(o, problem_.camera), &point_loss_, unknowns_.pose(o.pose), point);
      ordering_->AddElementToGroup(point, 0);
    }
    for (const int i : used.lines) {
      const BundleLineObservation& o = problem_.line_observations[static_cast<std::size_t>(i)];
      double* line = unknowns_.line(static_cast<std::size_t>(o.line));
      ceres_.AddParameterBlock(line, kLineBlock, &line_manifold_);
      ceres_.AddResidualBlock(new LineCost(o, problem_.camera), &line_loss_, unknowns_.pose(o.pose), line);
      ordering_->AddElementToGroup(line, 0);
    }
  }
  void add(const BundleEdge& edge, ceres::LossFunction* loss) {
    ceres_.AddResidualBlock(new EdgeCost(edge), loss, unknowns_.pose(edge.a), unknowns_.pose(edge.b));
  }

  const BundleProblem& problem_;
  const BundleOptions& options_;
  BundleState& state_;
  MapUnknowns unknowns_;
  ceres::HuberLoss point_loss_;
  ceres::HuberLoss line_loss_;
  ceres::HuberLoss edge_loss_;
  PoseManifold pose_manifold_;
  LineManifold line_manifold_;
  std::shared_ptr<ceres::ParameterBlockOrdering> ordering_ =
      std::make_shared<ceres::ParameterBlockOrdering>();
  ceres::Problem ceres_;
};

}  // namespace

RoundSummary solve_map_round(const BundleProblem& problem, const BundleOptions& options, BundleState& state) {
  return MapRound(problem, options, state).solve();
}

}  // namespace plumbline::optimize
