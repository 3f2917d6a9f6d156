// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Bundle adjustment with the camera among the unknowns: poses, points, and the parameters that all images
// share (Zhang, PAMI 22, 2000; readout as in Hedborg, Forssen, Felsberg, Ringaby, CVPR 2012). Poses and
// points are eliminated: the result is a quadratic function of the camera, from which any trial follows at
// once. Plain structs in and out; Ceres inside. Deterministic: one thread, fixed order.
#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/sensor/camera.hpp"

namespace plumbline::optimize {

/// Unknowns common to all images, as changes of the given camera.
enum CameraUnknown : std::size_t {
  kFocal,    ///< fx and fy are longer by this share
  kReadout,  ///< seconds, from the first row to the last: the value itself, not a change
  kSlopeX,   ///< added to sensor::Camera::depth_slope, 1/m
  kSlopeY,
  kCentreX,  ///< added to cx, px
  kCentreY,
  kK1,  ///< added to the distortion
  kK2,
  kDelay,  ///< added to sensor::Camera::depth_delay_s, seconds
  kCameraUnknowns
};
using CameraChange = Eigen::Matrix<double, kCameraUnknowns, 1>;
using CameraCovariance = Eigen::Matrix<double, kCameraUnknowns, kCameraUnknowns>;

/// Numbers of a camera's file that are right or wrong together.
enum CameraGroup : std::size_t {
  kFocalGroup,
  kCentreGroup,
  kLensGroup,  ///< k1 and k2
  kSlopeGroup,
  kDelayGroup,
  kReadoutGroup,
  kCameraGroups
};
CameraGroup group_of(CameraUnknown unknown);

struct CalibrationPose {
  geometry::Rigid3 camera_from_world;  ///< when the middle row was read
  /// (m/s, rad/s): camera_from_world(t + dt) = Exp(velocity dt) camera_from_world(t).
  geometry::Vector6d velocity = geometry::Vector6d::Zero();
  bool fixed = false;
  int block = 0;  ///< a second or so of the recording, whose errors are taken as independent of other seconds
};

/// Pose `pose` sees point `point` at `pixel` of the image as the lens shows it, not undistorted.
struct CalibrationObservation {
  int pose = -1;
  int point = -1;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  double pixel_sigma = 1.0;
  double depth = 0.0;  ///< metres as the given camera's reader gives it; 0: none
  double depth_sigma = 1.0;
  double depth_rate = 0.0;  ///< m/s: how fast the depth on its ray changes as the camera moves
  Eigen::Vector2d ray = Eigen::Vector2d::Zero();  ///< (x, y) of the undistorted pixel, where depth was read
};

struct CalibrationProblem {
  sensor::Camera camera;  ///< as given
  std::vector<CalibrationPose> poses;
  std::vector<Eigen::Vector3d> points;  ///< world, metres
  std::vector<CalibrationObservation> observations;
  /// Set by camera_evidence(): the camera's change at which poses and points are at their optimum, and how
  /// they follow it, to first order. A row for each turn and shift of a pose, in their order, then for each
  /// coordinate of a point; no rows: not known yet.
  CameraChange optimum = CameraChange::Zero();
  Eigen::Matrix<double, Eigen::Dynamic, kCameraUnknowns> following{};
};

/// A quadratic function of the change: gradient and second derivative at CameraEvidence::at.
struct EvidenceBlock {
  CameraChange gradient = CameraChange::Zero();
  CameraCovariance information = CameraCovariance::Zero();
};

/// Evidence of a problem about its camera, with poses and points at their optimum: half the squared standard
/// deviations, a quadratic function of the change.
struct CameraEvidence {
  CameraChange at = CameraChange::Zero();  ///< point of linearisation
  double cost = 0.0;                       ///< there
  EvidenceBlock all;
  std::vector<EvidenceBlock> blocks;  ///< parts that add up to it, by CalibrationPose::block

  [[nodiscard]] double cost_of(const CameraChange& change) const;
};

/// Each group of the file's numbers is right, to `right_sigma`, or wrong, by `wrong_sigma`.
struct CameraPrior {
  CameraChange mean = CameraChange::Zero();         ///< the file
  CameraChange right_sigma = CameraChange::Ones();  ///< > 0
  CameraChange wrong_sigma = CameraChange::Ones();  ///< > 0
  std::array<double, kCameraGroups> wrong{};        ///< probability, 0 to 1
};

/// Knowledge of a camera: mean and covariance of a mixture over which groups of the file are wrong.
struct CameraPosterior {
  CameraChange mean = CameraChange::Zero();
  CameraCovariance covariance = CameraCovariance::Zero();
  std::array<double, kCameraGroups> wrong{};  ///< probability that the file is
};

/// The given camera, changed.
sensor::Camera changed_camera(const sensor::Camera& given, const CameraChange& change);
/// The change that makes `camera` of `given`; both have the same ratio of fx to fy.
CameraChange change_between(const sensor::Camera& given, const sensor::Camera& camera);

/// The evidence of a problem around the camera that `change` makes of the given one, poses (those that are
/// not fixed) and points being adjusted to that: the problem has them afterwards, so that the next call
/// begins there. None: it could not be solved.
std::optional<CameraEvidence> camera_evidence(CalibrationProblem& problem, const CameraChange& change);

/// The camera given all evidence and the prior. The covariance of the evidence is taken from the scatter of
/// its blocks (docs/method/calibration.md). The readout is never negative.
CameraPosterior camera_posterior(const std::vector<CameraEvidence>& evidence, const CameraPrior& prior);

}  // namespace plumbline::optimize
