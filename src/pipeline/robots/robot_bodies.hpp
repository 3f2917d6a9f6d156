// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Gyroscopes and wheels of the robots of a run.
#include <memory>
#include <vector>

#include "plumbline/core/log.hpp"
#include "plumbline/inertial/body_motion.hpp"
#include "plumbline/pipeline/robot_recordings.hpp"
#include "robots/robot_cameras.hpp"

namespace plumbline::pipeline {

class RobotBodies {
 public:
  /// `recordings` and `log` must outlive this.
  RobotBodies(const RobotRecordings& recordings, bool with_gyro, bool with_wheels, core::Log& log);

  /// For that robot's tracker; empty if it has no such sensor.
  [[nodiscard]] tracking::MotionSensor sensor(std::int32_t robot) const;
  /// Takes what a robot's sensors measured up to a frame; before it is tracked.
  void before(std::int32_t robot, double stamp);
  /// Learns from the poses that came since the last call.
  void after(std::int32_t robot, const std::vector<maps::FramePose>& poses);
  /// Gives poses to frames that were lost for a moment, and the state "bridged" to their rows.
  void bridge(Slams& slams, std::vector<FrameRow>& rows);

  /// Adds the section "sensors" and the bridged frames, where there are readings.
  void report(Json& summary) const;

 private:
  struct Body {
    inertial::BodyMotion motion;
    std::size_t seen = 0;  ///< frame poses that it has learnt from
    inertial::Use told_gyro = inertial::Use::kNone, told_wheels = inertial::Use::kNone;
    std::optional<inertial::FeltUp> up = std::nullopt;
  };
  void tell(const RobotInfo& robot, const char* what, inertial::Use now, inertial::Use& told);

  const RobotRecordings& recordings_;
  core::Log& log_;
  std::vector<std::unique_ptr<Body>> bodies_;  ///< by robot
  std::size_t bridged_ = 0;
};

/// Adds how far up by the accelerometer of a single robot is from that of the floor.
void report_up(const geometry::Rigid3& output_from_map, Json& summary);

}  // namespace plumbline::pipeline
