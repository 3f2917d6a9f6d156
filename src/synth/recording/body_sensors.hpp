// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Inertial sensor and wheel odometry of the body that carries the camera. The body's frame is at the camera,
// x forward, y to the left, z up.
#include <string>
#include <vector>

#include "plumbline/dataset/body_readings.hpp"
#include "plumbline/synth/source.hpp"
#include "scene/faults.hpp"

namespace plumbline::synth {

/// Errors of one inertial sensor, drawn from a model.
struct ImuErrors {
  Eigen::Vector3d gyro_bias, accel_bias;  ///< rad/s, m/s^2 at the first reading
  Eigen::Matrix3d gyro_axes, accel_axes;  ///< reading = axes true + bias
};
ImuErrors imu_errors(const ImuModel& model, std::uint64_t seed);

/// Readings from the first frame to the last.
std::vector<dataset::ImuReading> imu_readings(const SynthSource& source, const ImuModel& model,
                                              std::uint64_t seed);
std::vector<dataset::OdometryReading> odometry_readings(const SynthSource& source, const OdometryModel& model,
                                                        std::uint64_t seed);

/// Texts of imu.csv and odometry.csv.
std::string describe_imu(const std::vector<dataset::ImuReading>& readings);
std::string describe_odometry(const std::vector<dataset::OdometryReading>& readings);

}  // namespace plumbline::synth
