// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/tracking/motion_model.hpp"

#include "plumbline/tracking/tracker.hpp"

namespace plumbline::tracking {

geometry::Rigid3 MotionModel::predict(double stamp) const {
  if (knows_odometry()) return odometry_->inverse() * *last_odometry_ * camera_from_world_;
  geometry::Rigid3 motion = motion_within(std::clamp(stamp - stamp_, 0.0, 0.2));
  if (knows_wheels()) motion = *sensed_.moved;
  // The camera's centre moves as before; the gyroscope measures the rotation better.
  if (knows_turn())
    motion = {*sensed_.turned, *sensed_.turned * (motion.rotation.transpose() * motion.translation)};
  return motion * camera_from_world_;
}

std::optional<geometry::Vector6d> MotionModel::velocity_after(double stamp, const geometry::Rigid3& pose,
                                                              double dt) const {
  const double step_s = stamp - stamp_;
  if (!continuous() || !(step_s > 1e-4 && step_s < 0.5)) return std::nullopt;
  // Velocities are means over their steps; that of the middle of `dt` lies half a step and dt / 2 further on.
  const geometry::Vector6d mean = geometry::log_se3(pose * camera_from_world_.inverse()) / step_s;
  if (velocity_.isZero(0.0)) return with_turn_rate(mean);
  return with_turn_rate(mean + (0.5 + 0.5 * dt / step_s) * (mean - velocity_));
}

bool MotionModel::reliable(double stamp) const {
  constexpr double kLonger = 1.5;
  if (continuous() && knows_odometry()) return true;
  return continuous() && steps_ >= 2 && stamp - stamp_ < kLonger * step_s_;
}

void MotionModel::update(double stamp, const TrackResult& result) {
  // Share of a change of motion that is ignored in directions that hardly anything else constrains.
  constexpr double kDoubt = 0.75;
  const double dt = stamp - stamp_;
  dead_reckoning_s_ = result.dead_reckoned && valid_ ? dead_reckoning_s_ + dt : 0.0;

  // Velocity between consecutive frames
  if (continuous() && dt > 1e-4 && dt < 0.5) {
    const bool known = reliable(stamp);
    const geometry::Vector6d before = velocity_;
    velocity_ = geometry::log_se3(result.camera_from_world * camera_from_world_.inverse()) / dt;

    // In directions that mainly the motion model constrains, steps are mostly noise, which would accumulate.
    if (known && !result.motion_contradicted)
      velocity_ -= kDoubt * (result.onto_degenerate * (velocity_ - before));
    ++steps_;
    step_s_ = dt;
  } else {
    reset();
  }

  contradicted_ = result.motion_contradicted;
  lost_frames_ = 0;
  stamp_ = stamp;
  camera_from_world_ = result.camera_from_world;
  valid_ = true;
  last_odometry_ = odometry_;
}

void MotionModel::lost() {
  ++lost_frames_;
  velocity_ *= 0.8;
}

void MotionModel::reset() {
  velocity_.setZero();
  steps_ = 0;
  valid_ = false;
}

void MotionModel::restore(double stamp, const geometry::Vector6d& velocity) {
  stamp_ = stamp;
  valid_ = true;
  velocity_ = velocity;
  steps_ = 2;
  step_s_ = 0.2;  // not known: any that predict() looks ahead
  lost_frames_ = 0;
}

}  // namespace plumbline::tracking
