// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Measurements of the body that carries a camera: inertial sensor and wheels.
#include <Eigen/Core>
#include <optional>
#include <vector>

#include "plumbline/geometry/rigid3.hpp"

namespace plumbline::dataset {

/// In the frame of the body: x forward, y to the left, z up; of other programs in that of their sensor.
struct ImuReading {
  double stamp = 0.0;
  Eigen::Vector3d turn_rate;     ///< rad/s
  Eigen::Vector3d acceleration;  ///< m/s^2, with gravity: (0, 0, 9.81) at rest
};

struct OdometryReading {
  double stamp = 0.0;
  geometry::Rigid3 odom_from_body;  ///< in a plane, from the first reading's place on
  Eigen::Vector3d velocity;         ///< m/s, body
  double turn_rate = 0.0;           ///< rad/s, about z
};

struct BodyReadings {
  std::vector<ImuReading> imu;  ///< by stamp
  std::vector<OdometryReading> odometry;
  std::optional<geometry::Rigid3> body_from_camera;  ///< of the odometry's body; none: not known
};

/// The readings with stamps in (imu_after, until], odometry's in (odometry_after, until].
BodyReadings readings_between(const std::vector<ImuReading>& imu,
                              const std::vector<OdometryReading>& odometry, double imu_after,
                              double odometry_after, double until);

/// A FrameSource with such readings implements this, too. Thread-safe.
class BodySource {
 public:
  virtual ~BodySource() = default;
  /// The readings of readings_between(); a live source has those that have come.
  [[nodiscard]] virtual BodyReadings body_readings(double imu_after, double odometry_after,
                                                   double until) const = 0;
};

}  // namespace plumbline::dataset
