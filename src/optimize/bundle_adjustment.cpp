// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/optimize/bundle_adjustment.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bundle_solver.hpp"
#include "bundle_terms.hpp"
#include "plumbline/optimize/pose_terms.hpp"

namespace plumbline::optimize {
namespace {

// Copies the solution to the problem; fixed poses stay.
void write_back(const BundleState& state, BundleProblem& problem) {
  for (std::size_t i = 0; i < problem.poses.size(); ++i) {
    if (!problem.poses[i].fixed) problem.poses[i].camera_from_world = state.poses[i];
  }
  problem.points = state.points;
  for (std::size_t i = 0; i < problem.lines.size(); ++i)
    problem.lines[i] = geometry::to_plucker(state.lines[i]);
}

/// Collects the squared errors of observations that fit.
class FitSum {
 public:
  void add(double squared, bool fits) {
    ++fit_.all;
    if (!fits) return;
    ++fit_.fitting;
    sum_ += squared;
  }
  /// The fit; each squared error has `coordinates` coordinates.
  [[nodiscard]] BundleFit fit(int coordinates) const {
    BundleFit fit = fit_;
    if (fit.fitting > 0) fit.rms = std::sqrt(sum_ / (coordinates * static_cast<double>(fit.fitting)));
    return fit;
  }

 private:
  BundleFit fit_;
  double sum_ = 0.0;
};

/// Smallest first gate, pixels: corners and lines known to a tenth of a pixel are not excluded for a third of
/// one.
constexpr double kLeastFirstGate_px = 0.8;

/// Rejects as an outlier what exceeds a gate of squared standard deviations and `least_px`.
class Gate {
 public:
  Gate(const BundleState& state, const sensor::Pinhole& camera, double point_gate, double line_gate,
       double least_px)
      : state_(state),
        camera_(camera),
        projection_(geometry::line_projection(camera.fx, camera.fy, camera.cx, camera.cy)),
        point_gate_(point_gate),
        line_gate_(line_gate),
        least_px2_(least_px * least_px) {
    for (const geometry::OrthonormalLine& line : state.lines) lines_.push_back(geometry::to_plucker(line));
  }

  /// Squared error in standard deviations; infinite if the observation is impossible.
  double mark(BundlePointObservation& o) const {
    PointTerm term = to_term(o);
    term.world = state_.points[static_cast<std::size_t>(o.point)];
    Eigen::Vector3d r;
    const int rows =
        point_residual(term, state_.poses[static_cast<std::size_t>(o.pose)], camera_, r, nullptr);
    const double squared = rows == 0 ? kInfinity : r.head<2>().squaredNorm();
    o.outlier = beyond(squared, point_gate_, o.pixel_sigma);
    return squared;
  }
  /// A line through the camera's centre has no image, so the observation cannot be of it.
  double mark(BundleLineObservation& o) const {
    LineTerm term;
    term.world = lines_[static_cast<std::size_t>(o.line)];
    term.start = o.start;
    term.end = o.end;
    term.pixel_sigma = o.pixel_sigma;
    Eigen::Vector2d r;
    const Rigid3& pose = state_.poses[static_cast<std::size_t>(o.pose)];
    const bool has_image = line_residual(term, pose, projection_, r, nullptr);
    const double squared = has_image ? r.squaredNorm() : kInfinity;
    o.outlier = beyond(squared, line_gate_, o.pixel_sigma);
    return squared;
  }

 private:
  using Rigid3 = geometry::Rigid3;
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();
  /// True if an error is beyond the gate or not a number.
  [[nodiscard]] bool beyond(double squared, double gate, double pixel_sigma) const {
    return !(squared <= std::max(gate, least_px2_ / (pixel_sigma * pixel_sigma)));
  }
  const BundleState& state_;
  const sensor::Pinhole& camera_;
  Eigen::Matrix3d projection_;
  double point_gate_;
  double line_gate_;
  double least_px2_;
  std::vector<geometry::PluckerLine> lines_;
};

// Errors of the edges at this state.
BundleFit fit_of_edges(const BundleProblem& problem, const BundleState& state) {
  FitSum sum;
  for (const BundleEdge& edge : problem.edges) {
    const geometry::Rigid3& a = state.poses[static_cast<std::size_t>(edge.a)];
    const geometry::Rigid3& b = state.poses[static_cast<std::size_t>(edge.b)];
    const geometry::Vector6d xi = geometry::log_se3(b * a.inverse() * edge.b_from_a.inverse());
    sum.add(xi.dot(edge.information * xi), true);
  }
  return sum.fit(6);
}

/// Marks observations beyond the gates as outliers. Returns the fits by the gates of the options.
BundleFits mark_outliers(BundleProblem& problem, const BundleState& state, const BundleOptions& options,
                         double point_gate, double line_gate, double least_px) {
  const Gate gate(state, problem.camera, point_gate, line_gate, least_px);
  FitSum points, lines;
  for (BundlePointObservation& o : problem.point_observations) {
    const double squared = gate.mark(o);
    points.add(squared, squared <= options.point_gate);
  }
  for (BundleLineObservation& o : problem.line_observations) {
    const double squared = gate.mark(o);
    lines.add(squared, squared <= options.line_gate);
  }
  return {points.fit(2), lines.fit(2), fit_of_edges(problem, state)};
}

/// Solves in rounds; between them, observations that do not fit are marked as outliers.
template <typename SolveRound>
BundleSummary adjust(BundleProblem& problem, const BundleOptions& options, const SolveRound& solve_round) {
  BundleSummary summary;
  const bool anchored =
      std::any_of(problem.poses.begin(), problem.poses.end(), [](const BundlePose& p) { return p.fixed; });
  if (!anchored) {
    summary.message = "no pose is fixed: the solution would float";
    return summary;
  }

  // Gross outliers first, with a wide gate
  BundleState state = state_of(problem);
  if (options.first_gate > 0.0) {
    const double gate = options.first_gate * options.first_gate;
    summary.before = mark_outliers(problem, state, options, gate, gate, kLeastFirstGate_px);
  }

  // Outliers are judged again after every round
  for (int round = 0; round < options.rounds; ++round) {
    const RoundSummary done = solve_round(problem, options, state);
    if (round == 0) summary.initial_cost = done.initial_cost;
    summary.message = done.message;
    if (!done.usable) return summary;
    summary.final_cost = done.final_cost;
    summary.iterations += done.iterations;
    summary.after = mark_outliers(problem, state, options, options.point_gate, options.line_gate, 0.0);
  }

  write_back(state, problem);
  summary.usable = true;
  for (const auto& o : problem.point_observations) summary.point_outliers += o.outlier ? 1 : 0;
  for (const auto& o : problem.line_observations) summary.line_outliers += o.outlier ? 1 : 0;
  return summary;
}

}  // namespace

BundleState state_of(const BundleProblem& problem) {
  BundleState state;
  for (const BundlePose& pose : problem.poses) state.poses.push_back(pose.camera_from_world);
  state.points = problem.points;

  // Lines by four unknowns instead of six
  for (const geometry::PluckerLine& line : problem.lines)
    state.lines.push_back(geometry::to_orthonormal(line));
  return state;
}

void BundleOptions::declare(core::OptionTable& table) {
  table.integer("bundle.max_iterations", max_iterations, {1, 1000}, "",
                "Largest number of iterations in each round");
  table.integer("bundle.rounds", rounds, {1, 10}, "", "Solves; between them outliers are put aside");
}

BundleSummary adjust_bundle(BundleProblem& problem, const BundleOptions& options) {
  return adjust(problem, options, solve_bundle_round);
}

BundleSummary adjust_map_bundle(BundleProblem& problem, const BundleOptions& options) {
  return adjust(problem, options, solve_map_round);
}

}  // namespace plumbline::optimize
