// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Pose of one camera relative to another one on the same body, from the paths of both (hand-eye calibration;
// docs/method/merging.md). The cameras need not see the same things.
#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/geometry/trajectory.hpp"

namespace plumbline::geometry {

/// Pose at `stamp`, interpolated between the neighbours in time; none if these are more than `longest_s`
/// apart.
std::optional<Rigid3> pose_between(const Trajectory& trajectory, double stamp, double longest_s);

/// Longest time between two poses of a path within which it is interpolated.
constexpr double kInterpolated_s = 0.15;

/// Motions of both cameras over the same time.
struct CommonMotion {
  Rigid3 reference_start_from_end;
  Rigid3 camera_start_from_end;
  int duration = 0;     ///< index of its nominal duration: motions of one duration have the same noise
  double weight = 1.0;  ///< number of independent measurements that it counts as
};

/// Motions over 0.5, 1 and 2 s, wherever both paths are known; one of each begins every tenth of a second.
/// Each counts by the share of its duration after the start of the one before, divided among the durations,
/// since motions that overlap are not independent. Both paths are in frames of their own, with stamps of one
/// clock.
std::vector<CommonMotion> common_motions(const Trajectory& reference, const Trajectory& camera);

/// Pose that is known beforehand; standard deviations in the axes of the reference camera, infinite where
/// nothing is known.
struct HandEyePrior {
  Rigid3 reference_from_camera;
  Eigen::Vector3d sigma_m = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector3d sigma_rad = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
};

struct HandEye {
  Rigid3 reference_from_camera;
  /// Covariance of (rho, phi): the true position is the estimated one plus rho, the true rotation
  /// Exp(phi) times the estimated one; axes of the reference camera.
  Matrix6d covariance = Matrix6d::Identity();
  std::size_t motions = 0;
  double independent = 0.0;  ///< number of independent motions that they count as
  double residual_m = 0.0;   ///< robust standard deviation of one component over about 1 s
  double residual_rad = 0.0;
  /// Directions in which the position is not determined: unit vectors, axes of the reference camera.
  std::vector<Eigen::Vector3d> free_positions;
  bool free_rotation = false;  ///< the rotation is not determined in some direction

  [[nodiscard]] bool determined() const { return free_positions.empty() && !free_rotation; }
};

/// Solves A X = X B for all motions A of the reference camera and B of the other: rotation in closed form
/// from the axes of rotation, position by linear least squares, then both together with a robust loss. What
/// neither the motions nor the prior determine to 3 cm or 1.1 degrees is reported as free.
HandEye find_hand_eye(const std::vector<CommonMotion>& motions, const HandEyePrior& prior = {});

/// Constant difference of two clocks: reference stamp = camera stamp + offset.
struct ClockOffset {
  double offset_s = 0.0;
  double sigma_s = std::numeric_limits<double>::infinity();  ///< infinite: the motion does not show it
};

/// The difference, up to half a second, at which both cameras turn by the same angles at the same time.
ClockOffset find_clock_offset(const Trajectory& reference, const Trajectory& camera);

}  // namespace plumbline::geometry
