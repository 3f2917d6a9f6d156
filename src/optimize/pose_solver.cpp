// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/optimize/pose_solver.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

namespace plumbline::optimize {
namespace {

using geometry::Matrix6d;
using geometry::Rigid3;
using geometry::Vector6d;

struct PoseEquations {
  Matrix6d h = Matrix6d::Zero();  ///< lower triangle of the sum over terms
  Vector6d g = Vector6d::Zero();
  double cost = 0.0;
};

/// Huber: cost and weight of a squared error in standard deviations.
struct Robust {
  double cost;
  double weight;
};
Robust huber(double squared, double threshold) {
  const double error = std::sqrt(squared);
  if (error <= threshold) return {0.5 * squared, 1.0};
  return {threshold * (error - 0.5 * threshold), threshold / error};
}

/// Residual of a landmark that does not project into the image at a pose, standard deviations: moving it
/// behind the camera must not lower the cost.
constexpr double kUnseen = 1e3;

/// Levenberg-Marquardt damping, the same for all directions of a block. Marquardt's scaling by each diagonal
/// entry would hardly damp weak directions: with one wall in view, moving along it by d / sin(tilt) changes
/// the distance to the wall as much as moving towards it by d.
Vector6d damping(const Matrix6d& h, double lambda) {
  Vector6d d;
  d.head<3>().setConstant(lambda * h.diagonal().head<3>().maxCoeff() + 1e-9);
  d.tail<3>().setConstant(lambda * h.diagonal().tail<3>().maxCoeff() + 1e-9);
  return d;
}

/// Lower triangle of the sums of w j^T j and w j^T r, each row padded to whole SIMD vectors, at the
/// price of more products than needed. Every entry is summed in the order of the terms.
struct RowSums {
  alignas(32) double h[6][8] = {};
  alignas(32) double g[8] = {};

  void add(const Row6& j, double r, double w) {
    // The lower triangle, in whole vectors
    alignas(32) const double row[8] = {j(0), j(1), j(2), j(3), j(4), j(5), 0.0, 0.0};
    for (int a = 0; a < 4; ++a) {
      const double wa = w * row[a];
      for (int b = 0; b < 4; ++b) h[a][b] += wa * row[b];
    }
    for (int a = 4; a < 6; ++a) {
      const double wa = w * row[a];
      for (int b = 0; b < 6; ++b) h[a][b] += wa * row[b];
    }
    for (int a = 0; a < 6; ++a) g[a] += (w * row[a]) * r;
  }

  void move_to(PoseEquations& n) const {
    for (int a = 0; a < 6; ++a) {
      for (int b = 0; b <= a; ++b) n.h(a, b) = h[a][b];
      n.g(a) = g[a];
    }
  }
};

/// Adds reprojection and depth errors of points: e_p of the paper's section 3.2.
void add_points(const PoseProblem& problem, const Rigid3& pose, const PoseSolverOptions& options,
                RowSums& sums, double& cost) {
  Eigen::Vector3d r;
  Eigen::Matrix<double, 3, 6> j;
  for (const PointTerm& term : problem.points) {
    const int rows = point_residual(term, pose, problem.camera, r, &j);
    if (rows == 0) {
      cost += options.point_weight * huber(kUnseen * kUnseen, options.point_loss).cost;
      continue;
    }

    const Robust pixel = huber(r.head<2>().squaredNorm(), options.point_loss);
    cost += options.point_weight * pixel.cost;
    sums.add(j.row(0), r(0), options.point_weight * pixel.weight);
    sums.add(j.row(1), r(1), options.point_weight * pixel.weight);
    if (rows < 3 || !options.depth_rows) continue;

    const Robust depth = huber(r(2) * r(2), options.plane_loss);
    cost += options.point_weight * depth.cost;

    // The depth of a corner has the robust weight of its pixel, too.
    sums.add(j.row(2), r(2), options.point_weight * depth.weight * pixel.weight);
  }
}

/// Adds distances of measured ends from the projected lines: e_l of section 3.2.
void add_lines(const PoseProblem& problem, const Rigid3& pose, const PoseSolverOptions& options,
               RowSums& sums, double& cost) {
  const Eigen::Matrix3d projection =
      geometry::line_projection(problem.camera.fx, problem.camera.fy, problem.camera.cx, problem.camera.cy);
  Eigen::Vector2d r;
  Eigen::Matrix<double, 2, 6> j;
  for (const LineTerm& term : problem.lines) {
    if (!line_residual(term, pose, projection, r, &j)) {
      cost += options.line_weight * huber(kUnseen * kUnseen, options.line_loss).cost;
      continue;
    }

    const Robust robust = huber(r.squaredNorm(), options.line_loss);
    cost += options.line_weight * robust.cost;
    sums.add(j.row(0), r(0), options.line_weight * robust.weight);
    sums.add(j.row(1), r(1), options.line_weight * robust.weight);
  }
}

/// Adds point-to-plane distances (docs/method/least_squares.md).
void add_planes(const PoseProblem& problem, const Rigid3& pose, const PoseSolverOptions& options,
                RowSums& sums, double& cost) {
  Row6 j;
  for (const PlaneTerm& term : problem.planes) {
    const double r = plane_residual(term, pose, &j);
    const Robust robust = huber(r * r, options.plane_loss);
    cost += options.plane_weight * robust.cost;
    sums.add(j, r, options.plane_weight * robust.weight);
  }
}

PoseEquations evaluate(const PoseProblem& problem, const Rigid3& pose, const PoseSolverOptions& options) {
  PoseEquations n;
  RowSums sums;
  add_points(problem, pose, options, sums, n.cost);
  add_lines(problem, pose, options, sums, n.cost);
  add_planes(problem, pose, options, sums, n.cost);
  sums.move_to(n);

  // All photometric terms together have one weight
  if (problem.photometric) {
    const PhotometricSums seen = sum_photometric(*problem.photometric, pose, options.photometric_loss);
    n.h += options.photometric_weight * seen.h;
    n.g += options.photometric_weight * seen.g;
    n.cost += options.photometric_weight * seen.cost;
  }
  return n;
}

/// Adds the prior's cost; the derivative of log(Exp(xi) T M^-1) by xi is taken as identity (small
/// differences).
void add_prior(const PoseProblem& problem, const Rigid3& pose, PoseEquations& n) {
  if (!problem.prior) return;
  const Vector6d e = geometry::log_se3(pose * problem.prior->camera_from_world.inverse());
  const Vector6d g = problem.prior->information * e;
  n.cost += 0.5 * e.dot(g);
  n.g += g;
  n.h += problem.prior->information;
}

// Squared errors of the depth samples.
std::vector<double> plane_errors(const PoseProblem& problem, const Rigid3& pose) {
  std::vector<double> errors;
  errors.reserve(problem.planes.size());
  for (const PlaneTerm& term : problem.planes) {
    const double r = plane_residual(term, pose, nullptr);
    errors.push_back(r * r);
  }
  return errors;
}

std::vector<double> photometric_errors(const PoseProblem& problem, const Rigid3& pose) {
  std::vector<double> errors;
  if (!problem.photometric) return errors;
  for (const float r : photometric_residuals(*problem.photometric, pose))
    errors.push_back(static_cast<double>(r) * static_cast<double>(r));
  return errors;
}

// Terms within three sigmas, and their RMS.
FamilySummary summarise(const std::vector<double>& squared) {
  constexpr double kGateSq = 9.0;
  FamilySummary s;
  s.terms = static_cast<int>(squared.size());
  double sum = 0.0;
  for (double e : squared) {
    if (!(e <= kGateSq)) continue;
    ++s.inliers;
    sum += e;
  }
  if (s.inliers > 0) s.rms = std::sqrt(sum / s.inliers);
  return s;
}

}  // namespace

void PoseSolverOptions::declare(core::OptionTable& table) {
  table.number("solver.point_weight", point_weight, {0.0, 100.0}, "", "Weight of all points together");
  table.number("solver.line_weight", line_weight, {0.0, 100.0}, "", "Weight of all lines together");
  table.boolean("solver.depth_rows", depth_rows, "Use the depth of points, too");
  table.number("solver.plane_weight", plane_weight, {0.0, 100.0}, "", "Weight of all depth samples together");
  table.number("solver.photometric_weight", photometric_weight, {0.0, 100.0}, "",
               "Weight of all grey values together");
}

PoseSummary solve_pose(const PoseProblem& problem, const Rigid3& camera_from_world,
                       const PoseSolverOptions& options) {
  PoseSummary summary;
  Rigid3 pose = camera_from_world;
  PoseEquations n = evaluate(problem, pose, options);

  // Information without the prior, for the summary
  summary.information = n.h;
  add_prior(problem, pose, n);
  summary.initial_cost = n.cost;

  // Levenberg-Marquardt, until the step is small
  double lambda = 1e-5;
  for (; summary.iterations < options.max_iterations && !summary.converged; ++summary.iterations) {
    Matrix6d damped = n.h.selfadjointView<Eigen::Lower>();
    damped.diagonal() += damping(n.h, lambda);
    const Vector6d step = -damped.ldlt().solve(n.g);
    if (!step.allFinite()) break;

    // Cost and information at the new pose
    const Rigid3 trial = geometry::exp_se3(step) * pose;
    PoseEquations at_trial = evaluate(problem, trial, options);
    const Matrix6d information = at_trial.h;
    add_prior(problem, trial, at_trial);
    summary.converged = step.cwiseAbs().maxCoeff() < options.min_step;

    // Accepted if the cost does not rise
    if (at_trial.cost <= n.cost) {
      pose = trial;
      n = at_trial;
      summary.information = information;
      lambda = std::max(1e-9, lambda * 0.1);
    } else {
      lambda *= 10.0;
      summary.converged = summary.converged || lambda > 1e6;
    }
  }

  summary.information = summary.information.selfadjointView<Eigen::Lower>();
  summary.camera_from_world = pose;
  summary.final_cost = n.cost;

  // Inliers of each family at the solution
  summary.points = summarise(point_errors(problem, pose));
  summary.lines = summarise(line_errors(problem, pose));
  summary.planes = summarise(plane_errors(problem, pose));
  summary.photometric = summarise(photometric_errors(problem, pose));
  return summary;
}

std::vector<double> point_errors(const PoseProblem& problem, const Rigid3& camera_from_world) {
  std::vector<double> errors;
  errors.reserve(problem.points.size());
  for (const PointTerm& term : problem.points) {
    // Behind the camera: never an inlier
    Eigen::Vector3d r;
    const int rows = point_residual(term, camera_from_world, problem.camera, r, nullptr);
    errors.push_back(rows == 0 ? std::numeric_limits<double>::infinity() : r.head<2>().squaredNorm());
  }
  return errors;
}

std::vector<double> line_errors(const PoseProblem& problem, const Rigid3& camera_from_world) {
  const Eigen::Matrix3d projection =
      geometry::line_projection(problem.camera.fx, problem.camera.fy, problem.camera.cx, problem.camera.cy);
  std::vector<double> errors;
  errors.reserve(problem.lines.size());
  for (const LineTerm& term : problem.lines) {
    Eigen::Vector2d r;
    const bool valid = line_residual(term, camera_from_world, projection, r, nullptr);
    errors.push_back(valid ? r.squaredNorm() : std::numeric_limits<double>::infinity());
  }
  return errors;
}

}  // namespace plumbline::optimize
