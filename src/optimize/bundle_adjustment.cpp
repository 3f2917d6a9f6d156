// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/optimize/bundle_adjustment.hpp"

#include <algorithm>
#include <cmath>

#include "bundle_solver.hpp"
#include "bundle_terms.hpp"
#include "plumbline/optimize/pose_terms.hpp"

namespace plumbline::optimize {
namespace {

BundleState state_of(const BundleProblem& problem) {
  BundleState state;
  for (const BundlePose& pose : problem.poses) state.poses.push_back(pose.camera_from_world);
  state.points = problem.points;
  for (const geometry::PluckerLine& line : problem.lines)
    state.lines.push_back(geometry::to_orthonormal(line));
  return state;
}

void write_back(const BundleState& state, BundleProblem& problem) {
  for (std::size_t i = 0; i < problem.poses.size(); ++i) {
    if (!problem.poses[i].fixed) problem.poses[i].camera_from_world = state.poses[i];
  }
  problem.points = state.points;
  for (std::size_t i = 0; i < problem.lines.size(); ++i)
    problem.lines[i] = geometry::to_plucker(state.lines[i]);
}

/// Beyond these squared standard deviations an observation is an outlier.
class Gate {
 public:
  Gate(const BundleState& state, const sensor::Pinhole& camera, double point_gate, double line_gate)
      : state_(state),
        camera_(camera),
        projection_(geometry::line_projection(camera.fx, camera.fy, camera.cx, camera.cy)),
        point_gate_(point_gate),
        line_gate_(line_gate) {
    for (const geometry::OrthonormalLine& line : state.lines) lines_.push_back(geometry::to_plucker(line));
  }

  void mark(BundlePointObservation& o) const {
    PointTerm term = to_term(o);
    term.world = state_.points[static_cast<std::size_t>(o.point)];
    Eigen::Vector3d r;
    const int rows =
        point_residual(term, state_.poses[static_cast<std::size_t>(o.pose)], camera_, r, nullptr);
    o.outlier = rows == 0 || !(r.head<2>().squaredNorm() <= point_gate_);
  }
  /// A line through the camera's centre has no image: it cannot be what was seen there.
  void mark(BundleLineObservation& o) const {
    LineTerm term;
    term.world = lines_[static_cast<std::size_t>(o.line)];
    term.start = o.start;
    term.end = o.end;
    term.pixel_sigma = o.pixel_sigma;
    Eigen::Vector2d r;
    const Rigid3& pose = state_.poses[static_cast<std::size_t>(o.pose)];
    const bool has_image = line_residual(term, pose, projection_, r, nullptr);
    o.outlier = !has_image || !(r.squaredNorm() <= line_gate_);
  }

 private:
  using Rigid3 = geometry::Rigid3;
  const BundleState& state_;
  const sensor::Pinhole& camera_;
  Eigen::Matrix3d projection_;
  double point_gate_;
  double line_gate_;
  std::vector<geometry::PluckerLine> lines_;
};

void mark_outliers(BundleProblem& problem, const BundleState& state, double point_gate, double line_gate) {
  const Gate gate(state, problem.camera, point_gate, line_gate);
  for (BundlePointObservation& o : problem.point_observations) gate.mark(o);
  for (BundleLineObservation& o : problem.line_observations) gate.mark(o);
}

}  // namespace

void BundleOptions::declare(core::OptionTable& table) {
  table.integer("bundle.max_iterations", max_iterations, {1, 1000}, "", "Iterations of each round at most");
  table.integer("bundle.rounds", rounds, {1, 10}, "", "Solves; between them outliers are put aside");
  table.number("bundle.tolerance", tolerance, {0.0, 0.1}, "",
               "A round ends with an iteration that lowers the cost by a smaller share");
  table.number("bundle.point_loss", point_loss, {0.1, 100.0}, "",
               "Huber threshold of points, standard deviations");
  table.number("bundle.line_loss", line_loss, {0.1, 100.0}, "",
               "Huber threshold of lines, standard deviations");
  table.number("bundle.edge_loss", edge_loss, {0.1, 1000.0}, "",
               "Huber threshold of relative poses, standard deviations");
}

BundleSummary adjust_bundle(BundleProblem& problem, const BundleOptions& options,
                            const core::Executor* executor) {
  BundleSummary summary;
  const bool anchored =
      std::any_of(problem.poses.begin(), problem.poses.end(), [](const BundlePose& p) { return p.fixed; });
  if (!anchored) {
    summary.message = "no pose is fixed: the solution would float";
    return summary;
  }
  BundleState state = state_of(problem);
  core::Crew crew(executor);
  if (options.first_gate > 0.0) {
    const double gate = options.first_gate * options.first_gate;
    mark_outliers(problem, state, gate, gate);
  }
  for (int round = 0; round < options.rounds; ++round) {
    const RoundSummary done = solve_bundle_round(problem, options, crew, state);
    if (round == 0) summary.initial_cost = done.initial_cost;
    summary.message = done.message;
    if (!done.usable) return summary;
    summary.final_cost = done.final_cost;
    summary.iterations += done.iterations;
    mark_outliers(problem, state, options.point_gate, options.line_gate);
  }
  write_back(state, problem);
  summary.usable = true;
  for (const auto& o : problem.point_observations) summary.point_outliers += o.outlier ? 1 : 0;
  for (const auto& o : problem.line_observations) summary.line_outliers += o.outlier ? 1 : 0;
  return summary;
}

}  // namespace plumbline::optimize
