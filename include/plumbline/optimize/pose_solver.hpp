// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Pose of one camera from points, lines, surfaces and grey values of the map together: Levenberg-Marquardt
// with robust losses over 6 unknowns (docs/method/least_squares.md). Small and allocation-free; many poses
// together are the work of bundle_adjustment.
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "plumbline/core/options.hpp"
#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/optimize/photometric_terms.hpp"
#include "plumbline/optimize/pose_terms.hpp"
#include "plumbline/sensor/camera.hpp"

namespace plumbline::optimize {

/// Gaussian belief about the pose: xi = log(camera_from_world * mean^-1) has this information.
struct PosePrior {
  geometry::Rigid3 camera_from_world;
  geometry::Matrix6d information = geometry::Matrix6d::Zero();
};

struct PoseProblem {
  sensor::Pinhole camera;
  std::vector<PointTerm> points;
  std::vector<LineTerm> lines;
  std::vector<PlaneTerm> planes;
  std::optional<PhotometricFamily> photometric;
  std::optional<PosePrior> prior;
};

struct PoseSolverOptions {
  int max_iterations = 10;
  /// Huber threshold, in standard deviations (chi-square 95 %, 2 degrees of freedom).
  double point_loss = 2.45;
  double line_loss = 2.45;
  double plane_loss = 1.0;
  double point_weight = 1.0;  ///< of the whole family: its terms are not quite independent
  double line_weight = 1.0;
  bool depth_rows = true;      ///< the depth of points constrains the pose as well
  double plane_weight = 0.08;  ///< depth noise is correlated between neighbouring pixels
  double photometric_loss = 1.5;
  double photometric_weight = 0.04;  ///< grey values of neighbouring pixels are strongly correlated
  double min_step = 1e-6;            ///< metres and radians: a smaller step ends the iteration

  void declare(core::OptionTable& table);
};

struct FamilySummary {
  int terms = 0;
  int inliers = 0;   ///< within 3 standard deviations
  double rms = 0.0;  ///< of the inliers, in standard deviations
};

struct PoseSummary {
  geometry::Rigid3 camera_from_world;
  FamilySummary points;
  FamilySummary lines;
  FamilySummary planes;
  FamilySummary photometric;
  double initial_cost = 0.0;
  double final_cost = 0.0;
  int iterations = 0;
  bool converged = false;
  /// Information of xi = (rho, phi) at the solution, without the prior.
  geometry::Matrix6d information = geometry::Matrix6d::Zero();
};

/// Starts at `camera_from_world`; never returns a pose of higher cost than the start.
PoseSummary solve_pose(const PoseProblem& problem, const geometry::Rigid3& camera_from_world,
                       const PoseSolverOptions& options);

/// Squared residuals, in standard deviations, of each term at a pose; +inf where the term has no residual.
std::vector<double> point_errors(const PoseProblem& problem, const geometry::Rigid3& camera_from_world);
std::vector<double> line_errors(const PoseProblem& problem, const geometry::Rigid3& camera_from_world);

}  // namespace plumbline::optimize
