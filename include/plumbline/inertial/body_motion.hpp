// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Motion of a camera as a gyroscope and wheels tell it, once it is known how they sit on it
// (docs/method/inertial.md).
#include <optional>
#include <vector>

#include "plumbline/dataset/body_readings.hpp"
#include "plumbline/tracking/motion_model.hpp"

namespace plumbline::inertial {

/// Motion between two frames in a row, as the tracker measured it.
struct CameraStep {
  double from = 0.0;  ///< s
  double to = 0.0;
  geometry::Rigid3 moved;  ///< camera at `to` from camera at `from`
  double sigma_m = 0.0;    ///< where it is known worst
};

/// A sensor's part in a run.
enum class Use {
  kNone,       ///< there are no readings
  kUndecided,  ///< too little motion so far to know how it sits
  kUsed,
  kIgnored,  ///< it contradicts the pictures
};
const char* to_string(Use use);

struct GyroCalibration {
  Eigen::Matrix3d camera_from_imu = Eigen::Matrix3d::Identity();
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();  ///< rad/s, in the sensor's frame
  double delay_s = 0.0;                            ///< by which its stamps are late
  double correlation = 0.0;                        ///< of its turn rates with those of the camera
};

struct WheelCalibration {
  geometry::Rigid3 body_from_camera;
  double scale = 1.0;  ///< metres of the map for one of the wheels
  double scale_sigma = 1.0;
  double turn_scale = 1.0;
  double agreeing = 0.0;  ///< share of the stretches that agree
};

/// Readings of a gyroscope with their integral over time.
class TurnRates {
 public:
  void add(const std::vector<dataset::ImuReading>& readings);
  [[nodiscard]] bool empty() const { return samples_.empty(); }
  [[nodiscard]] double last_stamp() const { return samples_.empty() ? -1e300 : samples_.back().stamp; }
  /// Mean rate of the sensor between two of its stamps; none: readings are missing there.
  [[nodiscard]] std::optional<Eigen::Vector3d> mean(double from, double to) const;
  /// Rotation of the camera, later from earlier, between two stamps of frames.
  [[nodiscard]] std::optional<Eigen::Matrix3d> turned(double from, double to,
                                                      const GyroCalibration& how) const;
  /// Mean acceleration, m/s^2 in the sensor's frame, with gravity; none: there is none.
  [[nodiscard]] std::optional<Eigen::Vector3d> acceleration(double from, double to) const;

 private:
  struct Sample {
    double stamp = 0.0;
    Eigen::Vector3d rate;
    Eigen::Vector3d acceleration;
    Eigen::Vector3d integral;  ///< of the rate, up to here
  };
  /// Number of the first sample later than `stamp`; 0: none before it, or a gap around it.
  [[nodiscard]] std::size_t after(double stamp) const;
  [[nodiscard]] Eigen::Vector3d integral_at(std::size_t after, double stamp) const;
  std::vector<Sample> samples_;
};

/// Axes, bias and delay from steps that turn enough; none: readings are missing.
std::optional<GyroCalibration> calibrate_gyro(const TurnRates& rates, const std::vector<CameraStep>& steps);

/// odom_from_body between the readings; none: they are missing there.
std::optional<geometry::Rigid3> wheels_at(const std::vector<dataset::OdometryReading>& readings,
                                          double stamp);

/// A stretch of the way by wheels and by pictures.
struct WheelStretch {
  geometry::Rigid3 body;    ///< body later from body earlier
  geometry::Rigid3 camera;  ///< camera later from camera earlier
};
/// `start`: how the body sits; `known`: as transforms of the robot say, else a guess. Slip is left out.
WheelCalibration calibrate_wheels(const std::vector<WheelStretch>& stretches, const geometry::Rigid3& start,
                                  bool known);

/// Motion by wheels, camera later from camera earlier.
geometry::Rigid3 camera_motion(const geometry::Rigid3& body, const WheelCalibration& how);

/// Everything of one robot. What it says depends on readings and steps alone, in their order.
class BodyMotion {
 public:
  BodyMotion(bool with_gyro, bool with_wheels) : with_gyro_(with_gyro), with_wheels_(with_wheels) {}
  void add(const dataset::BodyReadings& more);
  [[nodiscard]] double last_imu_stamp() const { return rates_.last_stamp(); }
  [[nodiscard]] double last_odometry_stamp() const { return wheels_.empty() ? -1e300 : wheels_.back().stamp; }

  /// Learns from a step; steps come in order.
  void observe(const CameraStep& step);
  /// Motion by the sensors that are in use.
  [[nodiscard]] tracking::SensedMotion between(double earlier, double later) const;

  [[nodiscard]] Use gyro_use() const;
  [[nodiscard]] Use wheel_use() const;
  [[nodiscard]] const std::optional<GyroCalibration>& gyro() const { return gyro_; }
  [[nodiscard]] const std::optional<WheelCalibration>& wheels() const { return wheel_; }
  [[nodiscard]] const TurnRates& rates() const { return rates_; }

 private:
  void learn_turn(const CameraStep& step);
  void learn_wheels(const CameraStep& step);

  bool with_gyro_, with_wheels_;
  TurnRates rates_;
  std::vector<dataset::OdometryReading> wheels_;
  std::optional<geometry::Rigid3> body_from_camera_;

  std::vector<CameraStep> steps_;                     ///< that tell of the gyroscope
  Eigen::Matrix3d turned_ = Eigen::Matrix3d::Zero();  ///< sum of angle * axis axis^T, rad
  std::size_t next_gyro_ = 0;                         ///< steps at which it is calibrated again
  std::optional<GyroCalibration> gyro_;
  CameraStep stretch_;  ///< of the way, not yet long enough
  std::vector<WheelStretch> stretches_;
  double path_m_ = 0.0;  ///< of the stretches
  std::size_t next_wheels_ = 0;
  std::optional<WheelCalibration> wheel_;
};

/// A frame of a path; none: it is lost.
struct PathFrame {
  double stamp = 0.0;
  std::optional<geometry::Rigid3> camera_from_world;
};
/// Poses of lost frames between two others of one map that are at most a second apart: turns by the
/// gyroscope, both ends joined. Returns the numbers of these frames.
std::vector<std::size_t> bridge(const TurnRates& rates, const GyroCalibration& how,
                                std::vector<PathFrame>& path);

/// Up in the world by the accelerometer, of a path's frames: the mean of what it feels, and how far its
/// directions spread, rad. None: there is no accelerometer.
struct FeltUp {
  Eigen::Vector3d direction;
  double spread_rad = 0.0;
};
std::optional<FeltUp> felt_up(const TurnRates& rates, const GyroCalibration& how,
                              const std::vector<PathFrame>& path);

}  // namespace plumbline::inertial
