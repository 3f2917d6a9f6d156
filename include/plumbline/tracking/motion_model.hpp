// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Constant velocity on SE(3), or the recorder's own odometry: where the camera is expected at a time, and how
// far that can be trusted.
#include <algorithm>
#include <functional>
#include <optional>

#include "plumbline/geometry/rigid3.hpp"

namespace plumbline::tracking {

struct TrackResult;

/// Motion between two moments, measured by sensors of the body; none: not known.
struct SensedMotion {
  std::optional<geometry::Rigid3> moved;     ///< camera later from camera earlier, by wheels
  std::optional<Eigen::Matrix3d> turned;     ///< its rotation, by a gyroscope
  std::optional<Eigen::Vector3d> turn_rate;  ///< rad/s at the later moment, in the camera's frame
};
using MotionSensor = std::function<SensedMotion(double earlier, double later)>;

class MotionModel {
 public:
  /// Sets the recorder's odometry for the frame that is tracked next, world_from_camera in a world of its
  /// own; none: it has no pose.
  void set_odometry(const std::optional<geometry::Rigid3>& pose) { odometry_ = pose; }
  /// Sets the motion that sensors measured from the last tracked frame to the one that is tracked next.
  void set_sensed(SensedMotion sensed) { sensed_ = std::move(sensed); }
  /// camera_from_world at a time: by odometry, from the last tracked frame on, or else by velocity, at most
  /// 0.2 s after the last pose.
  [[nodiscard]] geometry::Rigid3 predict(double stamp) const;
  /// The motion of camera_from_world within `dt` seconds.
  [[nodiscard]] geometry::Rigid3 motion_within(double dt) const { return geometry::exp_se3(velocity_ * dt); }

  /// Mean velocity during the `dt` seconds after `stamp`, if camera_from_world is `pose` then: that of the
  /// last steps, continued linearly. None: the frame before is lost or too long ago.
  [[nodiscard]] std::optional<geometry::Vector6d> velocity_after(double stamp, const geometry::Rigid3& pose,
                                                                 double dt) const;

  /// Updates the model with a tracked frame.
  void update(double stamp, const TrackResult& result);
  /// Updates the model with a lost frame.
  void lost();
  /// Discards all poses found after the first `frames` lost ones.
  void lost_since(int frames) { lost_frames_ = frames; }
  /// Resets the model, because the camera was found elsewhere.
  void reset();
  /// Continues from a keyframe, with this velocity of camera_from_world per second.
  void restore(double stamp, const geometry::Vector6d& velocity);
  /// Sets the new position of the last pose after a correction of the map.
  void set_camera_from_world(const geometry::Rigid3& pose) { camera_from_world_ = pose; }
  [[nodiscard]] const geometry::Rigid3& camera_from_world() const { return camera_from_world_; }

  /// True if the previous frame was tracked.
  [[nodiscard]] bool continuous() const { return valid_ && lost_frames_ == 0; }
  /// True if the velocity is known, and no frame is missing since.
  [[nodiscard]] bool reliable(double stamp) const;
  /// True after a while without a pose: surfaces near the last one fit by chance.
  [[nodiscard]] int lost_frames() const { return lost_frames_; }
  [[nodiscard]] bool outdated() const {
    return lost_frames_ >= (knows_odometry() || knows_wheels() ? 60 : 5);
  }
  /// True after some more time without a pose: the last one is not used any more.
  [[nodiscard]] bool expired() const {
    return lost_frames_ >= (knows_odometry() || knows_wheels() ? 300 : 30);
  }
  /// Radius of the search for features around their prediction, pixels.
  [[nodiscard]] double search_radius_px() const { return 12.0 + 4.0 * std::min(lost_frames_, 5); }
  /// True if the motion model may still constrain a direction that no measurement constrains.
  [[nodiscard]] bool may_dead_reckon() const {
    return (continuous() || knows_wheels()) && dead_reckoning_s_ < (knows_wheels()     ? 60.0
                                                                    : knows_odometry() ? 20.0
                                                                                       : 2.5);
  }
  /// True if odometry gives the motion from the last tracked frame to the present one.
  [[nodiscard]] bool knows_odometry() const { return valid_ && odometry_ && last_odometry_; }
  /// True if wheels give the motion from the last tracked frame to the present one, except for slip.
  [[nodiscard]] bool knows_wheels() const { return valid_ && sensed_.moved; }
  /// True if a gyroscope gives its rotation.
  [[nodiscard]] bool knows_turn() const { return valid_ && sensed_.turned; }
  /// True if measurements have contradicted the model since little but surfaces was measured.
  [[nodiscard]] bool contradicted() const { return contradicted_; }

  [[nodiscard]] double last_stamp() const { return stamp_; }
  /// Velocity of the camera, (m/s, rad/s) in its frame: camera_from_world(t + dt) = Exp(velocity dt)
  /// camera_from_world(t). Zero if it is not known.
  [[nodiscard]] geometry::Vector6d velocity() const {
    return continuous() ? velocity_ : geometry::Vector6d(geometry::Vector6d::Zero());
  }
  /// The same at the present frame, its turn by the gyroscope where there is one.
  [[nodiscard]] geometry::Vector6d velocity_now() const { return with_turn_rate(velocity()); }
  [[nodiscard]] double turn_rate() const { return velocity_.tail<3>().norm(); }

 private:
  [[nodiscard]] geometry::Vector6d with_turn_rate(geometry::Vector6d velocity) const {
    if (sensed_.turn_rate) velocity.tail<3>() = -*sensed_.turn_rate;
    return velocity;
  }

  double stamp_ = 0.0;  ///< of the last tracked frame
  geometry::Rigid3 camera_from_world_;
  bool valid_ = false;
  geometry::Vector6d velocity_ = geometry::Vector6d::Zero();  ///< of camera_from_world, per second
  int steps_ = 0;        ///< number of consecutive steps from which the velocity was estimated
  double step_s_ = 0.0;  ///< duration of the last step
  int lost_frames_ = 0;
  double dead_reckoning_s_ = 0.0;  ///< time for which it has constrained unmeasured directions
  bool contradicted_ = false;
  SensedMotion sensed_;                            ///< from the last tracked frame to the present one
  std::optional<geometry::Rigid3> odometry_;       ///< of the present frame
  std::optional<geometry::Rigid3> last_odometry_;  ///< of the last tracked frame
};

}  // namespace plumbline::tracking
