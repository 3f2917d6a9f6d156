// SPDX-License-Identifier: BSD-3-Clause
// Gyroscopes and wheels of cameras whose motion is a formula.
#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "plumbline/inertial/body_motion.hpp"

namespace plumbline::inertial {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using geometry::Rigid3;

constexpr double kFrame_s = 1.0 / 30.0;
constexpr double kDegree = M_PI / 180.0;

/// A hand-held camera, which turns about `axes` of its axes.
Rigid3 world_from_hand(double t, int axes = 3) {
  const Vector3d turn(axes > 1 ? 0.7 * std::sin(1.3 * t) : 0.0, 1.2 * std::sin(0.9 * t),
                      axes > 2 ? 0.5 * std::sin(1.7 * t) : 0.0);
  return {geometry::exp_so3(turn), {0.3 * std::sin(t), 0.2 * std::cos(0.7 * t), 0.1 * t}};
}

/// A sensor that is turned against the camera, with bias, delay, noise and gaps.
struct SensorErrors {
  Matrix3d imu_from_camera = geometry::exp_so3({0.4, -1.1, 2.0});
  Vector3d bias{0.05, -0.03, 0.02};
  double delay_s = 0.03;
  double noise = 0.005;
};

std::vector<dataset::ImuReading> readings_of(double seconds, const SensorErrors& errors, int axes = 3) {
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0.0, errors.noise);
  std::vector<dataset::ImuReading> readings;
  constexpr double kStep_s = 0.005, kAround_s = 1e-4;
  for (double t = -0.5; t < seconds + 0.5; t += kStep_s) {
    const bool gap = std::fmod(t + 1.0, 5.0) < 0.05;
    const Rigid3 now = world_from_hand(t, axes);
    const Matrix3d change = now.rotation.transpose() * world_from_hand(t + kAround_s, axes).rotation;
    const Vector3d rate = geometry::log_so3(change) / kAround_s,
                   up = now.rotation.transpose() * Vector3d(0, 0, 9.81);
    const Vector3d wrong(noise(random), noise(random), noise(random));
    if (!gap) {
      readings.push_back({t + errors.delay_s, errors.imu_from_camera * rate + errors.bias + wrong,
                          errors.imu_from_camera * up});
    }
  }
  return readings;
}

CameraStep step_from(int frame, int axes = 3) {
  const double from = frame * kFrame_s, to = (frame + 1) * kFrame_s;
  return {from, to, world_from_hand(to, axes).inverse() * world_from_hand(from, axes), 0.002};
}

BodyMotion after_seconds(double seconds, const std::vector<dataset::ImuReading>& imu, int axes = 3) {
  BodyMotion motion(true, true);
  motion.add({imu, {}, {}});
  for (int i = 0; i * kFrame_s < seconds; ++i) motion.observe(step_from(i, axes));
  return motion;
}

TEST(Gyro, AxesBiasAndDelayAreFound) {
  const SensorErrors errors;
  const BodyMotion motion = after_seconds(20.0, readings_of(20.0, errors));
  ASSERT_EQ(motion.gyro_use(), Use::kUsed);
  const GyroCalibration& found = *motion.gyro();
  EXPECT_LT(geometry::rotation_angle(found.camera_from_imu * errors.imu_from_camera), 0.5 * kDegree);
  EXPECT_LT((found.bias - errors.bias).norm(), 0.005);
  EXPECT_NEAR(found.delay_s, errors.delay_s, 0.002);

  const auto sensed = motion.between(12.0, 12.8);
  ASSERT_TRUE(sensed.turned && sensed.turn_rate);
  const Rigid3 truth = world_from_hand(12.8).inverse() * world_from_hand(12.0);
  EXPECT_LT(geometry::rotation_angle(*sensed.turned * truth.rotation.transpose()), 0.5 * kDegree);
  EXPECT_FALSE(motion.between(3.9, 25.0).turned);
}

TEST(Gyro, NothingIsSaidBeforeTwoAxesHaveTurned) {
  EXPECT_EQ(after_seconds(0.3, readings_of(20.0, {})).gyro_use(), Use::kUndecided);
  const BodyMotion about_one = after_seconds(20.0, readings_of(20.0, {}, 1), 1);
  EXPECT_EQ(about_one.gyro_use(), Use::kUndecided);
  EXPECT_FALSE(about_one.between(5.0, 5.1).turned);
  EXPECT_EQ(BodyMotion(true, true).gyro_use(), Use::kNone);
}

TEST(Gyro, MirroredAxesAreIgnored) {
  SensorErrors errors;
  errors.imu_from_camera = Vector3d(1.0, 1.0, -1.0).asDiagonal();
  const BodyMotion motion = after_seconds(20.0, readings_of(20.0, errors));
  EXPECT_EQ(motion.gyro_use(), Use::kIgnored);
  EXPECT_FALSE(motion.between(5.0, 5.1).turned);
}

TEST(Gyro, BridgesOfASecondAreCloseAndLongerOnesAreNotMade) {
  const BodyMotion motion = after_seconds(20.0, readings_of(20.0, {}));
  std::vector<PathFrame> path;
  for (double t = 8.0; t < 14.0; t += kFrame_s) {
    const bool lost = (t > 9.02 && t < 9.7) || (t > 11.02 && t < 12.5);
    path.push_back({t, lost ? std::nullopt : std::optional<Rigid3>(world_from_hand(t).inverse())});
  }
  const std::vector<std::size_t> bridged = bridge(motion.rates(), *motion.gyro(), path);
  EXPECT_THAT(bridged, testing::SizeIs(testing::AllOf(testing::Gt(15U), testing::Lt(25U))));
  for (const std::size_t i : bridged) {
    EXPECT_LT(path[i].stamp, 9.8);
    const Rigid3 off = *path[i].camera_from_world * world_from_hand(path[i].stamp);
    EXPECT_LT(geometry::rotation_angle(off.rotation), 1.5 * kDegree) << i;
    EXPECT_LT(off.translation.norm(), 0.02) << i;
  }
}

TEST(Gyro, UpIsFelt) {
  const BodyMotion motion = after_seconds(20.0, readings_of(20.0, {}));
  std::vector<PathFrame> path;
  for (double t = 8.0; t < 14.0; t += kFrame_s) path.push_back({t, world_from_hand(t).inverse()});
  const auto up = felt_up(motion.rates(), *motion.gyro(), path);
  ASSERT_TRUE(up);
  EXPECT_LT(std::acos(up->direction.z()), 1.0 * kDegree);
}

/// A robot that drives curves, seen by its camera, which is not quite where one would think.
const Rigid3 kBodyFromCamera{
    (Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished() * geometry::exp_so3({0.1, 0.05, 0}),
    {0.2, 0.05, 0.0}};

Rigid3 world_from_robot(double t, double heading) {
  const double yaw = heading + 0.6 * std::sin(0.5 * t);
  // The integral of the speed along the heading, by small steps.
  Vector3d place = Vector3d::Zero();
  for (double s = 0.0; s < t; s += 0.01) {
    const double at = heading + 0.6 * std::sin(0.5 * s);
    place += 0.01 * 0.5 * Vector3d(std::cos(at), std::sin(at), 0.0);
  }
  return {geometry::exp_so3({0.0, 0.0, yaw}), place};
}

BodyMotion driven(double seconds, double wheel_scale, double slip_m, const std::optional<Rigid3>& told) {
  dataset::BodyReadings wheels;
  wheels.body_from_camera = told;
  std::vector<Rigid3> path;
  const auto frames = static_cast<int>(seconds / kFrame_s);
  for (int i = 0; i <= frames; ++i) path.push_back(world_from_robot(i * kFrame_s, 0.3));
  Rigid3 odom;
  for (int i = 0; i <= frames; ++i) {
    if (i > 0) {
      Rigid3 step = path[static_cast<std::size_t>(i) - 1].inverse() * path[static_cast<std::size_t>(i)];
      step.translation *= wheel_scale;
      if (i >= 150 && i < 160) step.translation.x() += slip_m / 10.0;
      odom = odom * step;
    }
    wheels.odometry.push_back({i * kFrame_s, odom, Vector3d::Zero(), 0.0});
  }

  BodyMotion motion(true, true);
  motion.add(wheels);
  for (std::size_t i = 1; i < path.size(); ++i) {
    const Rigid3 before = path[i - 1] * kBodyFromCamera, now = path[i] * kBodyFromCamera;
    motion.observe({wheels.odometry[i - 1].stamp, wheels.odometry[i].stamp, now.inverse() * before, 0.002});
  }
  return motion;
}

TEST(Wheels, ScaleIsFoundInSpiteOfSlip) {
  for (const auto& told : {std::optional<Rigid3>(), std::optional<Rigid3>(kBodyFromCamera)}) {
    const BodyMotion motion = driven(16.0, 1.0 / 1.03, 0.2, told);
    ASSERT_EQ(motion.wheel_use(), Use::kUsed);
    EXPECT_NEAR(motion.wheels()->scale, 1.03, 0.005);
    EXPECT_LT(motion.wheels()->scale_sigma, 0.005);
    const auto sensed = motion.between(10.0, 14.0);
    ASSERT_TRUE(sensed.moved);
    const Rigid3 truth = (world_from_robot(14.0, 0.3) * kBodyFromCamera).inverse() *
                         world_from_robot(10.0, 0.3) * kBodyFromCamera;
    EXPECT_LT((*sensed.moved * truth.inverse()).translation.norm(), 0.02);  // of 2 m
  }
}

TEST(Wheels, NothingIsSaidBeforeAFewMetres) {
  EXPECT_EQ(driven(4.0, 1.0, 0.0, std::nullopt).wheel_use(), Use::kUndecided);
}

TEST(Wheels, ThoseOfAnotherRobotAreIgnored) {
  dataset::BodyReadings wheels;
  for (int i = 0; i < 600; ++i) {
    const Rigid3 other = world_from_robot(i * kFrame_s, 0.0);
    wheels.odometry.push_back(
        {i * kFrame_s, {other.rotation.transpose(), 3.0 * other.translation}, Vector3d::Zero(), 0.0});
  }
  BodyMotion motion(true, true);
  motion.add(wheels);
  for (int i = 1; i < 590; ++i) motion.observe(step_from(i - 1));
  EXPECT_EQ(motion.wheel_use(), Use::kIgnored);
  EXPECT_FALSE(motion.between(5.0, 5.1).moved);
}

TEST(BodyMotion, WithoutItsOptionsItSaysNothing) {
  BodyMotion motion(false, false);
  motion.add({readings_of(2.0, {}), {}, {}});
  EXPECT_EQ(motion.gyro_use(), Use::kNone);
}

}  // namespace
}  // namespace plumbline::inertial
