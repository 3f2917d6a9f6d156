// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Bundle adjustment with the camera among the unknowns: poses, points, and what all images share (Zhang,
// PAMI 22, 2000; readout as in Hedborg, Forssen, Felsberg, Ringaby, CVPR 2012). Plain structs in and out;
// Ceres inside. Deterministic: one thread, fixed order.
#include <Eigen/Core>
#include <array>
#include <vector>

#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/sensor/camera.hpp"

namespace plumbline::optimize {

/// What all images share, as a change of the camera that was given.
enum CameraUnknown : std::size_t {
  kFocal,    ///< fx and fy are longer by this share
  kReadout,  ///< seconds, from the first row to the last: the value itself, not a change
  kSlopeX,   ///< added to sensor::Camera::depth_slope, 1/m
  kSlopeY,
  kCentreX,  ///< added to cx, px
  kCentreY,
  kK1,  ///< added to the distortion
  kK2,
  kCameraUnknowns
};
using CameraChange = std::array<double, kCameraUnknowns>;

struct CalibrationPose {
  geometry::Rigid3 camera_from_world;  ///< when the middle row was read
  /// (m/s, rad/s): camera_from_world(t + dt) = Exp(velocity dt) camera_from_world(t).
  geometry::Vector6d velocity = geometry::Vector6d::Zero();
  bool fixed = false;
};

/// Pose `pose` sees point `point` at `pixel` of the image as the lens shows it, not undistorted.
struct CalibrationObservation {
  int pose = -1;
  int point = -1;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  double pixel_sigma = 1.0;
  double depth = 0.0;  ///< metres as the given camera's reader gives it; 0: none
  double depth_sigma = 1.0;
  Eigen::Vector2d ray = Eigen::Vector2d::Zero();  ///< (x, y) of the undistorted pixel, where depth was read
};

struct CalibrationProblem {
  sensor::Camera camera;  ///< as given
  CameraChange change{};
  CameraChange prior_mean{};
  CameraChange prior_sigma{};                ///< > 0
  std::array<bool, kCameraUnknowns> free{};  ///< others keep the value they have in `change`
  std::vector<CalibrationPose> poses;
  std::vector<Eigen::Vector3d> points;  ///< world, metres
  std::vector<CalibrationObservation> observations;
};

/// Pixel of the image, distortion and all, of the undistorted pixel.
Eigen::Vector2d distorted_pixel(const sensor::Camera& camera, const Eigen::Vector2d& undistorted);

/// The given camera, changed.
sensor::Camera changed_camera(const sensor::Camera& given, const CameraChange& change);

/// Updates poses that are not fixed, points and what is free of the camera. Returns the robust cost, half the
/// squared standard deviations, without the prior; NaN when it could not be solved.
double adjust_with_camera(CalibrationProblem& problem, int max_iterations = 25);

}  // namespace plumbline::optimize
