// SPDX-License-Identifier: BSD-3-Clause
#include "recording/body_sensors.hpp"

#include <fmt/format.h>

#include <cmath>

#include "scene/random.hpp"

namespace plumbline::synth {

using Eigen::Vector3d;

namespace {

Vector3d normals(Rng& rng, double sigma) {
  const double x = rng.normal(), y = rng.normal(), z = rng.normal();
  return sigma * Vector3d(x, y, z);
}

/// Scales and directions of three axes.
Eigen::Matrix3d wrong_axes(Rng& rng, double scale, double misalign) {
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) axes(i, j) += rng.normal() * (i == j ? scale : misalign);
  }
  return axes;
}

double yaw_of(const geometry::Rigid3& world_from_body) {
  const Vector3d ahead = world_from_body.rotation * Vector3d::UnitX();
  return std::atan2(ahead.y(), ahead.x());
}

/// Errors of one device at the start of a recording.
ImuErrors draw_imu(const ImuModel& model, Rng& rng) {
  ImuErrors e;
  e.gyro_bias = normals(rng, model.gyro_bias);
  e.accel_bias = normals(rng, model.accel_bias);
  e.gyro_axes = wrong_axes(rng, model.scale, model.misalign);
  e.accel_axes = wrong_axes(rng, model.scale, model.misalign);
  return e;
}

constexpr std::uint64_t kImuStream = 0x1a0;

}  // namespace

ImuErrors imu_errors(const ImuModel& model, std::uint64_t seed) {
  Rng rng(seed, kImuStream);
  return draw_imu(model, rng);
}

std::vector<dataset::ImuReading> imu_readings(const SynthSource& source, const ImuModel& model,
                                              std::uint64_t seed) {
  const Vector3d gravity(0.0, 0.0, -9.81);
  const double step = 1.0 / model.rate, root = std::sqrt(model.rate);
  Rng rng(seed, kImuStream);
  auto [gyro_bias, accel_bias, gyro_axes, accel_axes] = draw_imu(model, rng);
  const geometry::Rigid3 camera_from_body = source.body_from_camera().inverse();
  std::vector<dataset::ImuReading> readings;
  double silent_until = -1.0;

  const double first = source.info(0).stamp, last = source.info(source.size() - 1).stamp;
  for (double t = first; t <= last + step; t += step) {
    const PathMotion motion = source.motion(t, camera_from_body);

    // Specific force: acceleration less gravity.
    const Vector3d force = motion.world_from_frame.rotation.transpose() * (motion.acceleration - gravity);
    const Vector3d gyro = gyro_axes * motion.turn_rate + gyro_bias + normals(rng, model.gyro_noise * root);
    const Vector3d accel = accel_axes * force + accel_bias + normals(rng, model.accel_noise * root);

    // Biases drift, and readings are lost.
    gyro_bias += normals(rng, model.gyro_walk * std::sqrt(step));
    accel_bias += normals(rng, model.accel_walk * std::sqrt(step));
    if (rng.chance(model.gaps / 60.0 * step)) silent_until = t + 0.05;
    if (t >= silent_until) readings.push_back({t + model.delay, gyro, accel});
  }
  return readings;
}

std::vector<dataset::OdometryReading> odometry_readings(const SynthSource& source, const OdometryModel& model,
                                                        std::uint64_t seed) {
  const double step = 1.0 / model.rate;
  const geometry::Rigid3 camera_from_body = source.body_from_camera().inverse();
  Rng rng(seed, 0x0d0);
  const double scale = 1.0 + model.scale * rng.normal(), turn = 1.0 + model.turn * rng.normal();
  std::vector<dataset::OdometryReading> readings;
  Eigen::Vector2d place = Eigen::Vector2d::Zero();
  double yaw = 0.0, slips_until = -1.0;

  const double first = source.info(0).stamp, last = source.info(source.size() - 1).stamp;
  for (double t = first; t <= last + step; t += step) {
    // The wheels turn from this reading to the next.
    const geometry::Rigid3 from = source.motion(t, camera_from_body).world_from_frame,
                           to = source.motion(t + step, camera_from_body).world_from_frame;

    // Motion in the body's frame, with slip and noise.
    const double heading = yaw_of(from), turned = std::remainder(yaw_of(to) - heading, 2.0 * M_PI);
    const Eigen::Rotation2Dd into_body(-(heading + 0.5 * turned));
    if (rng.chance(model.slip / 60.0 * step)) slips_until = t + 0.3;
    const double wrong = (t < slips_until ? 1.5 : 1.0) * (1.0 + model.noise * rng.normal());
    const Eigen::Vector2d moved = scale * wrong * (into_body * (to.translation - from.translation).head<2>());
    const double rotated = turn * wrong * turned;

    // Dead reckoning of place and direction.
    const Eigen::Quaterniond q(Eigen::AngleAxisd(yaw, Vector3d::UnitZ()));
    readings.push_back(
        {t, {q, {place.x(), place.y(), 0.0}}, {moved.x() / step, moved.y() / step, 0.0}, rotated / step});
    place += Eigen::Rotation2Dd(yaw + 0.5 * rotated) * moved;
    yaw += rotated;
  }
  return readings;
}

std::string describe_imu(const std::vector<dataset::ImuReading>& readings) {
  std::string text = "stamp,wx,wy,wz,ax,ay,az\n";
  for (const auto& r : readings) {
    text += fmt::format("{:.6f},{:.7f},{:.7f},{:.7f},{:.6f},{:.6f},{:.6f}\n", r.stamp, r.turn_rate.x(),
                        r.turn_rate.y(), r.turn_rate.z(), r.acceleration.x(), r.acceleration.y(),
                        r.acceleration.z());
  }
  return text;
}

std::string describe_odometry(const std::vector<dataset::OdometryReading>& readings) {
  std::string text = "stamp,x,y,yaw,vx,vy,wz\n";
  for (const auto& r : readings) {
    const Eigen::Quaterniond q = r.odom_from_body.quaternion();
    text += fmt::format("{:.6f},{:.6f},{:.6f},{:.7f},{:.6f},{:.6f},{:.7f}\n", r.stamp,
                        r.odom_from_body.translation.x(), r.odom_from_body.translation.y(),
                        2.0 * std::atan2(q.z(), q.w()), r.velocity.x(), r.velocity.y(), r.turn_rate);
  }
  return text;
}

}  // namespace plumbline::synth
