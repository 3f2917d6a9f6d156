// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Bundle adjustment over poses, points and lines, with relative-pose edges from dense alignment
// (docs/method/least_squares.md). Plain structs in, plain structs out. Every sum runs in a fixed order: the
// same bytes each time.
#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

#include "plumbline/core/options.hpp"
#include "plumbline/geometry/plucker.hpp"
#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/sensor/camera.hpp"

namespace plumbline::optimize {

struct BundlePose {
  geometry::Rigid3 camera_from_world;
  bool fixed = false;
};

/// Pose `pose` sees point `point` at `pixel`; with depth if depth > 0.
struct BundlePointObservation {
  int pose = -1;
  int point = -1;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  double pixel_sigma = 1.0;
  double depth = 0.0;        ///< metres
  double depth_sigma = 1.0;  ///< metres
  bool outlier = false;      ///< set by the solver; outliers on input are left out
};

/// Pose `pose` sees line `line` as the segment start-end, with 3D endpoints if has_depth.
struct BundleLineObservation {
  int pose = -1;
  int line = -1;
  Eigen::Vector2d start = Eigen::Vector2d::Zero();  ///< pixels
  Eigen::Vector2d end = Eigen::Vector2d::Zero();
  double pixel_sigma = 1.0;
  bool has_depth = false;
  Eigen::Vector3d start_camera = Eigen::Vector3d::Zero();  ///< metres, camera frame
  Eigen::Vector3d end_camera = Eigen::Vector3d::Zero();
  double start_sigma = 0.02;  ///< metres, in the plane of the line and the camera, across the line
  double end_sigma = 0.02;
  bool outlier = false;
};

/// Measured b_from_a; xi = log(b_from_a_estimate * measured^-1) has this information (it may be singular:
/// directions that the surfaces do not hold stay free).
struct BundleEdge {
  int a = -1;
  int b = -1;
  geometry::Rigid3 b_from_a;
  geometry::Matrix6d information = geometry::Matrix6d::Zero();
};

struct BundleProblem {
  sensor::Pinhole camera;
  std::vector<BundlePose> poses;
  std::vector<Eigen::Vector3d> points;       ///< world, metres
  std::vector<geometry::PluckerLine> lines;  ///< world
  std::vector<BundlePointObservation> point_observations;
  std::vector<BundleLineObservation> line_observations;
  std::vector<BundleEdge> edges;
};

struct BundleOptions {
  int max_iterations = 8;     ///< of each round
  int rounds = 2;             ///< after each, outliers are removed and the solve is repeated
  double tolerance = 1e-5;    ///< a round ends with an iteration that lowers the cost by a smaller share
  double first_radius = 1e4;  ///< of the trust region: a first step is damped by 1 over it, as Ceres does
  double point_loss = 2.45;   ///< Huber, standard deviations
  double line_loss = 2.45;
  double edge_loss = 4.0;
  double point_gate = 7.8;  ///< squared standard deviations; beyond: outlier
  double line_gate = 9.2;
  /// Gate in standard deviations: observations beyond it, and off by more than 0.8 px, are left out of the
  /// first round, and come back if they fit its result; 0: all are used. It is meant for poses that have just
  /// been corrected by better evidence: the observations that made the error would restore
  /// it.
  double first_gate = 0.0;
  void declare(core::OptionTable& table);
};

/// Residuals of the observations of one kind.
struct BundleFit {
  std::size_t all = 0;      ///< observations
  std::size_t fitting = 0;  ///< within BundleOptions::point_gate or line_gate
  double rms = 0.0;         ///< of these: of a coordinate, in the image or of an edge; standard deviations
};
struct BundleFits {
  BundleFit points;
  BundleFit lines;
  BundleFit edges;
};

struct BundleSummary {
  double initial_cost = 0.0;
  double final_cost = 0.0;
  int iterations = 0;
  int point_outliers = 0;
  int line_outliers = 0;
  BundleFits before;    ///< the first round; all zero without first_gate
  BundleFits after;     ///< the last round
  bool usable = false;  ///< poses, points and lines were updated
  std::string message;
};

/// Updates poses that are not fixed, points, lines and the outlier flags. Poses without any observation stay.
/// At least one pose must be fixed; nothing is changed (usable = false, message says why) otherwise.
/// For a window of keyframes: it takes a tenth of the time, but memory and time grow with the square and the
/// cube of the poses.
BundleSummary adjust_bundle(BundleProblem& problem, const BundleOptions& options);

/// The same for a whole map, by Ceres.
BundleSummary adjust_map_bundle(BundleProblem& problem, const BundleOptions& options);

}  // namespace plumbline::optimize
