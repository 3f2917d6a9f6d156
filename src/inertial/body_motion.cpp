// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/inertial/body_motion.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <utility>

namespace plumbline::inertial {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using geometry::Rigid3;

namespace {

constexpr double kLeastCorrelation = 0.95;
constexpr double kLeastTurn_rad = 0.5236;  // 30 degrees, about the second axis
constexpr double kLeastWay_m = 3.0;        // before wheels are judged
constexpr double kMostScaleSigma = 0.01;
constexpr double kLeastAgreeing = 0.6;
constexpr double kGrowth = 1.25;  // of the data, before all is estimated again

std::size_t later(std::size_t count) {
  return static_cast<std::size_t>(kGrowth * static_cast<double>(count)) + 1;
}

/// x to the right, y down, z ahead, of a body with x ahead, y to the left, z up.
Rigid3 looks_ahead() { return {(Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished(), Vector3d::Zero()}; }

}  // namespace

const char* to_string(Use use) {
  switch (use) {
    case Use::kNone:
      return "none";
    case Use::kUndecided:
      return "undecided";
    case Use::kUsed:
      return "used";
    case Use::kIgnored:
      return "ignored";
  }
  return "";
}

void BodyMotion::add(const dataset::BodyReadings& more) {
  if (with_gyro_) rates_.add(more.imu);
  if (!with_wheels_) return;
  wheels_.insert(wheels_.end(), more.odometry.begin(), more.odometry.end());
  if (!body_from_camera_) body_from_camera_ = more.body_from_camera;
}

Use BodyMotion::gyro_use() const {
  if (rates_.empty()) return Use::kNone;
  if (!gyro_) return Use::kUndecided;
  return gyro_->correlation >= kLeastCorrelation ? Use::kUsed : Use::kIgnored;
}

Use BodyMotion::wheel_use() const {
  if (wheels_.empty()) return Use::kNone;
  if (!wheel_) return Use::kUndecided;
  if (wheel_->agreeing < kLeastAgreeing) return Use::kIgnored;
  return wheel_->scale_sigma < kMostScaleSigma ? Use::kUsed : Use::kUndecided;
}

void BodyMotion::observe(const CameraStep& step) {
  constexpr double kMostSigma_m = 0.02;  // of steps that are certain enough
  const double dt = step.to - step.from;
  if (!(dt > 1e-3 && dt < 0.5)) return;
  const bool told = step.sigma_m < kMostSigma_m && step.moved.translation.allFinite();

  // An uncertain step ends the stretch begun.
  if (!told) stretch_ = {};
  if (told && !rates_.empty()) learn_turn(step);
  if (told && !wheels_.empty()) learn_wheels(step);
}

void BodyMotion::learn_turn(const CameraStep& step) {
  constexpr double kLeastRate = 0.15;  // rad/s, above the tracker's noise
  constexpr std::size_t kMostSteps = 4000;
  if (steps_.size() >= kMostSteps) return;
  steps_.push_back(step);

  // Turns about each axis that exceed the tracker's noise.
  const Vector3d turn = geometry::log_so3(step.moved.rotation);
  const double angle = turn.norm();
  if (angle > kLeastRate * (step.to - step.from)) turned_ += turn * turn.transpose() / angle;

  if (steps_.size() < next_gyro_) return;
  const Eigen::SelfAdjointEigenSolver<Matrix3d> axes(turned_, Eigen::EigenvaluesOnly);
  if (axes.eigenvalues()[1] < kLeastTurn_rad) return;
  gyro_ = calibrate_gyro(rates_, steps_);
  next_gyro_ = later(steps_.size());
}

void BodyMotion::learn_wheels(const CameraStep& step) {
  constexpr double kLeast_m = 0.25;  // of a stretch, or so large a turn
  constexpr double kLeast_rad = 0.25;
  constexpr std::size_t kFewest = 10;
  constexpr std::size_t kMost = 400;
  if (stretches_.size() >= kMost) return;
  stretch_.moved = stretch_.to == step.from ? step.moved * stretch_.moved : step.moved;
  if (stretch_.to != step.from) stretch_.from = step.from;
  stretch_.to = step.to;

  // A stretch is complete if it is long enough or turns enough.
  const double path_m = stretch_.moved.translation.norm();
  if (path_m < kLeast_m && geometry::rotation_angle(stretch_.moved.rotation) < kLeast_rad) return;
  const CameraStep whole = std::exchange(stretch_, {});
  const auto from = wheels_at(wheels_, whole.from), to = wheels_at(wheels_, whole.to);
  if (!from || !to) return;

  // Calibrated again when there is enough new data.
  stretches_.push_back({to->inverse() * *from, whole.moved});
  path_m_ += path_m;
  if (path_m_ < kLeastWay_m || stretches_.size() < std::max(kFewest, next_wheels_)) return;
  wheel_ =
      calibrate_wheels(stretches_, body_from_camera_.value_or(looks_ahead()), body_from_camera_.has_value());
  next_wheels_ = later(stretches_.size());
}

tracking::SensedMotion BodyMotion::between(double earlier, double now) const {
  constexpr double kLongestTurn_s = 3.0;
  constexpr double kLongestWay_s = 60.0;
  constexpr double kMoment_s = 0.01;
  tracking::SensedMotion sensed;
  const double dt = now - earlier;
  if (!(dt > 0.0)) return sensed;

  // Wheels measure the whole motion.
  if (wheel_use() == Use::kUsed && dt < kLongestWay_s) {
    const auto from = wheels_at(wheels_, earlier), to = wheels_at(wheels_, now);
    if (from && to) sensed.moved = camera_motion(to->inverse() * *from, *wheel_);
  }

  // The gyroscope measures rotation and present turn rate.
  if (gyro_use() == Use::kUsed && dt < kLongestTurn_s) {
    sensed.turned = rates_.turned(earlier, now, *gyro_);
    const auto rate = rates_.mean(now + gyro_->delay_s - kMoment_s, now + gyro_->delay_s + kMoment_s);
    if (sensed.turned && rate) sensed.turn_rate = gyro_->camera_from_imu * (*rate - gyro_->bias);
  }
  return sensed;
}

}  // namespace plumbline::inertial
