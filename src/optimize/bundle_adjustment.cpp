// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/optimize/bundle_adjustment.hpp"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "cost_edge.hpp"
#include "cost_line.hpp"
#include "cost_point.hpp"
#include "manifolds.hpp"

namespace plumbline::optimize {
namespace {

PointTerm to_term(const BundlePointObservation& o) {
  PointTerm term;
  term.pixel = o.pixel;
  term.pixel_sigma = o.pixel_sigma;
  term.depth = o.depth;
  term.depth_sigma = o.depth_sigma;
  return term;
}

/// The problem's numbers as Ceres wants them, and back. All in one buffer: within an elimination group Ceres
/// goes by the blocks' addresses, so that with points and lines in buffers of their own the order of its
/// sums, and with it the last digits of the result, would hang on where the heap put them.
class Blocks {
 public:
  explicit Blocks(const BundleProblem& problem)
      : poses_(problem.poses.size()), points_(problem.points.size()), lines_(problem.lines.size()) {
    numbers_.resize(7 * poses_ + 3 * points_ + 6 * lines_);
    for (std::size_t i = 0; i < poses_; ++i)
      from_rigid(problem.poses[i].camera_from_world, pose(static_cast<int>(i)));
    for (std::size_t i = 0; i < points_; ++i) {
      std::copy_n(problem.points[i].data(), 3, point(static_cast<int>(i)));
    }
    for (std::size_t i = 0; i < lines_; ++i) {
      from_line(geometry::to_orthonormal(problem.lines[i]), line(static_cast<int>(i)));
    }
  }
  [[nodiscard]] double* pose(int i) { return numbers_.data() + 7 * static_cast<std::size_t>(i); }
  [[nodiscard]] double* point(int i) {
    return numbers_.data() + 7 * poses_ + 3 * static_cast<std::size_t>(i);
  }
  [[nodiscard]] double* line(int i) {
    return numbers_.data() + 7 * poses_ + 3 * points_ + 6 * static_cast<std::size_t>(i);
  }
  void write_back(BundleProblem& problem) {
    for (std::size_t i = 0; i < poses_; ++i) {
      if (!problem.poses[i].fixed) problem.poses[i].camera_from_world = to_rigid(pose(static_cast<int>(i)));
    }
    for (std::size_t i = 0; i < points_; ++i)
      std::copy_n(point(static_cast<int>(i)), 3, problem.points[i].data());
    for (std::size_t i = 0; i < lines_; ++i) {
      problem.lines[i] = geometry::to_plucker(to_line(line(static_cast<int>(i))));
    }
  }

 private:
  std::size_t poses_;
  std::size_t points_;
  std::size_t lines_;
  std::vector<double> numbers_;
};

/// Poses that edges hold are held to where they are by 1 m and 1 rad as well: far weaker than anything
/// measured, but directions that an edge leaves free would otherwise run off (the solver scales each unknown
/// by what is known of it, and so prefers to move along them).
void hold_weakly(const BundleProblem& problem, Blocks& blocks, PoseBlock& origin,
                 ceres::Problem& ceres_problem) {
  std::vector<char> held(problem.poses.size(), 0);
  for (const BundleEdge& edge : problem.edges) {
    for (const int i : {edge.a, edge.b}) {
      const auto k = static_cast<std::size_t>(i);
      if (held[k] != 0 || problem.poses[k].fixed) continue;
      held[k] = 1;
      const BundleEdge stay{-1, i, to_rigid(blocks.pose(i)), geometry::Matrix6d::Identity()};
      ceres_problem.AddResidualBlock(new EdgeCost(stay), nullptr, origin.data(), blocks.pose(i));
      ceres_problem.SetParameterBlockConstant(origin.data());
    }
  }
}

/// How many inliers see each landmark. What one pose alone sees without depth would leave its block singular.
template <typename Seen>
std::vector<int> views(const std::vector<Seen>& observations, int Seen::*landmark, std::size_t landmarks) {
  std::vector<int> count(landmarks, 0);
  for (const Seen& o : observations) {
    if (!o.outlier) ++count[static_cast<std::size_t>(o.*landmark)];
  }
  return count;
}

/// Builds and solves one round; the Ceres problem does not outlive it.
ceres::Solver::Summary solve_round(BundleProblem& problem, Blocks& blocks, const BundleOptions& options) {
  ceres::Problem::Options problem_options;
  problem_options.cost_function_ownership = ceres::TAKE_OWNERSHIP;
  problem_options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  problem_options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::HuberLoss point_loss(options.point_loss);
  ceres::HuberLoss line_loss(options.line_loss);
  ceres::HuberLoss edge_loss(options.edge_loss);
  PoseManifold pose_manifold;
  PoseBlock origin;
  from_rigid({}, origin.data());
  LineManifold line_manifold;
  ceres::Problem ceres_problem(problem_options);
  auto* ordering = new ceres::ParameterBlockOrdering;  // owned by the solver's options

  for (std::size_t i = 0; i < problem.poses.size(); ++i) {
    double* pose = blocks.pose(static_cast<int>(i));
    ceres_problem.AddParameterBlock(pose, 7, &pose_manifold);
    if (problem.poses[i].fixed) ceres_problem.SetParameterBlockConstant(pose);
    ordering->AddElementToGroup(pose, 1);
  }
  const std::vector<int> point_views =
      views(problem.point_observations, &BundlePointObservation::point, problem.points.size());
  for (const BundlePointObservation& o : problem.point_observations) {
    if (o.outlier || (point_views[static_cast<std::size_t>(o.point)] < 2 && !(o.depth > 0.0))) continue;
    double* point = blocks.point(o.point);
    ceres_problem.AddResidualBlock(new PointCost(to_term(o), problem.camera), &point_loss,
                                   blocks.pose(o.pose), point);
    ordering->AddElementToGroup(point, 0);
  }
  const std::vector<int> line_views =
      views(problem.line_observations, &BundleLineObservation::line, problem.lines.size());
  for (const BundleLineObservation& o : problem.line_observations) {
    if (o.outlier || (line_views[static_cast<std::size_t>(o.line)] < 2 && !o.has_depth)) continue;
    double* line = blocks.line(o.line);
    if (!ceres_problem.HasParameterBlock(line)) {
      ceres_problem.AddParameterBlock(line, 6, &line_manifold);
      ordering->AddElementToGroup(line, 0);
    }
    ceres_problem.AddResidualBlock(new LineCost(o, problem.camera), &line_loss, blocks.pose(o.pose), line);
  }
  for (const BundleEdge& edge : problem.edges) {
    ceres_problem.AddResidualBlock(new EdgeCost(edge), &edge_loss, blocks.pose(edge.a), blocks.pose(edge.b));
  }

  hold_weakly(problem, blocks, origin, ceres_problem);
  if (ceres_problem.HasParameterBlock(origin.data())) ordering->AddElementToGroup(origin.data(), 1);

  ceres::Solver::Options solver;
  solver.linear_solver_type = problem.poses.size() <= 60 ? ceres::DENSE_SCHUR : ceres::SPARSE_SCHUR;
  solver.linear_solver_ordering.reset(ordering);
  solver.num_threads = 1;  // sums in a fixed order
  solver.max_num_iterations = options.max_iterations;
  solver.function_tolerance = options.tolerance;
  solver.parameter_tolerance = 1e-7;
  solver.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &ceres_problem, &summary);
  return summary;
}

/// Beyond these squared standard deviations an observation is an outlier.
void mark_outliers(BundleProblem& problem, Blocks& blocks, double point_gate, double line_gate) {
  for (BundlePointObservation& o : problem.point_observations) {
    PointTerm term = to_term(o);
    term.world = Eigen::Map<const Eigen::Vector3d>(blocks.point(o.point));
    Eigen::Vector3d r;
    const int rows = point_residual(term, to_rigid(blocks.pose(o.pose)), problem.camera, r, nullptr);
    o.outlier = rows == 0 || !(r.head<2>().squaredNorm() <= point_gate);
  }
  const Eigen::Matrix3d projection =
      geometry::line_projection(problem.camera.fx, problem.camera.fy, problem.camera.cx, problem.camera.cy);
  for (BundleLineObservation& o : problem.line_observations) {
    LineTerm term;
    term.world = geometry::to_plucker(to_line(blocks.line(o.line)));
    term.start = o.start;
    term.end = o.end;
    term.pixel_sigma = o.pixel_sigma;
    Eigen::Vector2d r;
    // A line through the camera's centre has no image: it cannot be what was seen there.
    const bool has_image = line_residual(term, to_rigid(blocks.pose(o.pose)), projection, r, nullptr);
    o.outlier = !has_image || !(r.squaredNorm() <= line_gate);
  }
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

BundleSummary adjust_bundle(BundleProblem& problem, const BundleOptions& options) {
  BundleSummary summary;
  const bool anchored =
      std::any_of(problem.poses.begin(), problem.poses.end(), [](const BundlePose& p) { return p.fixed; });
  if (!anchored) {
    summary.message = "no pose is fixed: the solution would float";
    return summary;
  }
  Blocks blocks(problem);
  if (options.first_gate > 0.0) {
    const double gate = options.first_gate * options.first_gate;
    mark_outliers(problem, blocks, gate, gate);
  }
  for (int round = 0; round < options.rounds; ++round) {
    const ceres::Solver::Summary ceres_summary = solve_round(problem, blocks, options);
    if (round == 0) summary.initial_cost = ceres_summary.initial_cost;
    if (!ceres_summary.IsSolutionUsable()) {
      summary.message = ceres_summary.message;
      return summary;
    }
    summary.final_cost = ceres_summary.final_cost;
    summary.iterations += static_cast<int>(ceres_summary.iterations.size());
    summary.message = ceres_summary.message;
    mark_outliers(problem, blocks, options.point_gate, options.line_gate);
  }
  blocks.write_back(problem);
  summary.usable = true;
  for (const auto& o : problem.point_observations) summary.point_outliers += o.outlier ? 1 : 0;
  for (const auto& o : problem.line_observations) summary.line_outliers += o.outlier ? 1 : 0;
  return summary;
}

}  // namespace plumbline::optimize
