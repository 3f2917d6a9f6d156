// SPDX-License-Identifier: BSD-3-Clause
#include "robots/robot_bodies.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "plumbline/maps/components.hpp"
#include "summary/sections.hpp"

namespace plumbline::pipeline {

using inertial::Use;

namespace {

Json vector_of(const Eigen::Vector3d& v) { return {rounded(v.x()), rounded(v.y()), rounded(v.z())}; }

/// The frames of a path, those of one component alone with a pose.
std::vector<inertial::PathFrame> path_of(const mapping::Slam& slam, core::KeyframeId component) {
  std::vector<inertial::PathFrame> path;
  for (const maps::FramePose& frame : slam.frame_poses()) {
    path.push_back({frame.stamp, std::nullopt});
    if (!frame.tracked || !slam.map().has_keyframe(frame.reference)) continue;
    if (maps::root_of(slam.map(), frame.reference) == component)
      path.back().camera_from_world =
          frame.camera_from_reference * slam.map().camera_from_world(frame.reference);
  }
  return path;
}

std::set<core::KeyframeId> components_in(const mapping::Slam& slam) {
  std::set<core::KeyframeId> roots;
  for (const core::KeyframeId id : slam.map().keyframe_ids()) roots.insert(maps::root_of(slam.map(), id));
  return roots;
}

}  // namespace

RobotBodies::RobotBodies(const RobotRecordings& recordings, bool with_gyro, bool with_wheels, core::Log& log)
    : recordings_(recordings), log_(log) {
  for (std::size_t r = 0; r < recordings.robots().size(); ++r)
    bodies_.push_back(std::make_unique<Body>(Body{inertial::BodyMotion(with_gyro, with_wheels)}));
}

tracking::MotionSensor RobotBodies::sensor(std::int32_t robot) const {
  const Body* body = bodies_[static_cast<std::size_t>(robot)].get();
  return [body](double earlier, double later) { return body->motion.between(earlier, later); };
}

void RobotBodies::before(std::int32_t robot, double stamp) {
  constexpr double kAhead_s = 0.2;  // more than stamps of a sensor are late
  inertial::BodyMotion& motion = bodies_[static_cast<std::size_t>(robot)]->motion;
  const auto* source = dynamic_cast<const dataset::BodySource*>(&recordings_.recording(robot));
  if (source != nullptr)
    motion.add(
        source->body_readings(motion.last_imu_stamp(), motion.last_odometry_stamp(), stamp + kAhead_s));
}

void RobotBodies::after(std::int32_t robot, const std::vector<maps::FramePose>& poses) {
  Body& body = *bodies_[static_cast<std::size_t>(robot)];
  for (; body.seen < poses.size(); ++body.seen) {
    const maps::FramePose& pose = poses[body.seen];
    if (body.seen == 0 || !pose.tracked || !pose.camera_from_previous) continue;
    body.motion.observe(
        {poses[body.seen - 1].stamp, pose.stamp, *pose.camera_from_previous, pose.step_sigma_m});
  }
  tell(recordings_.robot(robot), "inertial sensor", body.motion.gyro_use(), body.told_gyro);
  tell(recordings_.robot(robot), "odometry of wheels", body.motion.wheel_use(), body.told_wheels);
}

/// Says when a sensor is taken or left.
void RobotBodies::tell(const RobotInfo& robot, const char* what, Use now, Use& told) {
  if (std::exchange(told, now) == now) return;
  if (now == Use::kUsed)
    log_.info(fmt::format("{}: the {} agrees with the pictures and is used", robot.name, what));
  if (now == Use::kIgnored)
    log_.warning(fmt::format("{}: the {} contradicts the pictures and is ignored", robot.name, what));
}

void RobotBodies::bridge(Slams& slams, std::vector<FrameRow>& rows) {
  constexpr double kSigma_m = 0.02;
  for (const RobotInfo& robot : recordings_.robots()) {
    const auto number = static_cast<std::size_t>(robot.number);
    Body& body = *bodies_[number];
    if (body.motion.gyro_use() != Use::kUsed) continue;
    mapping::Slam& slam = *slams[number];
    std::vector<maps::FramePose> frames = slam.frame_poses();

    std::set<std::size_t> numbers;

    // Components have no known relative pose, so a gap is bridged only within one of them.
    for (const core::KeyframeId component : components_in(slam)) {
      std::vector<inertial::PathFrame> path = path_of(slam, component);
      if (!body.up) body.up = inertial::felt_up(body.motion.rates(), *body.motion.gyro(), path);
      for (const std::size_t i : inertial::bridge(body.motion.rates(), *body.motion.gyro(), path)) {
        maps::FramePose& frame = frames[i];

        // Relative to the same keyframe as the frame before, a bridged pose follows later adjustments of the
        // map.
        frame.reference = frames[i - 1].reference;
        frame.camera_from_reference =
            *path[i].camera_from_world * slam.map().camera_from_world(frame.reference).inverse();
        frame.tracked = true;
        frame.step_sigma_m = kSigma_m;
        if (const auto index = recordings_.frame_at(robot.number, frame.stamp)) numbers.insert(*index);
      }
    }

    if (numbers.empty()) continue;
    slam.set_frames(std::move(frames));

    for (FrameRow& row : rows) {
      const bool own = recordings_.robot_of(row.frame) == robot.number;
      if (!own || numbers.count(recordings_.frame_of(row.frame)) == 0) continue;
      row.state = FrameState::kBridged;
      ++bridged_;
    }
  }
}

void RobotBodies::report(Json& summary) const {
  for (const RobotInfo& robot : recordings_.robots()) {
    const Body& body = *bodies_[static_cast<std::size_t>(robot.number)];
    const inertial::BodyMotion& motion = body.motion;
    Json section = {{"robot", robot.name}};

    if (motion.gyro_use() != Use::kNone) {
      Json& gyro = section["gyro"] = {{"use", to_string(motion.gyro_use())}};
      if (const auto& how = motion.gyro()) {
        const Eigen::Quaterniond turn(how->camera_from_imu);
        gyro["correlation"] = rounded(how->correlation);
        gyro["bias"] = vector_of(how->bias);
        gyro["delay_s"] = rounded(how->delay_s);
        gyro["camera_from_imu"] = {rounded(turn.x()), rounded(turn.y()), rounded(turn.z()),
                                   rounded(turn.w())};
      }
      if (body.up) {
        gyro["up"] = vector_of(body.up->direction);
        gyro["up_spread_rad"] = rounded(body.up->spread_rad);
      }
    }

    if (motion.wheel_use() != Use::kNone) {
      Json& wheels = section["odometry"] = {{"use", to_string(motion.wheel_use())}};
      if (const auto& how = motion.wheels()) {
        wheels["scale"] = rounded(how->scale);
        wheels["scale_sigma"] = rounded(how->scale_sigma);
        wheels["turn_scale"] = rounded(how->turn_scale);
        wheels["agreeing"] = rounded(how->agreeing);
      }
    }

    if (section.size() > 1) summary["sensors"].push_back(section);
  }

  if (!summary.contains("sensors")) return;

  // While tracking, bridged frames were counted as lost; their poses came afterwards.
  FrameCounts frames(summary);
  frames.bridged = bridged_;
  frames.lost -= bridged_;
  frames.write(summary);
}

void report_up(const geometry::Rigid3& output_from_map, Json& summary) {
  if (!summary.contains("sensors") || summary["sensors"].size() != 1) return;
  Json& sensors = summary["sensors"][0];
  if (!sensors.contains("gyro") || !sensors["gyro"].contains("up")) return;
  Json& gyro = sensors["gyro"];
  const Eigen::Vector3d felt(gyro["up"][0], gyro["up"][1], gyro["up"][2]);
  const double up = (output_from_map.rotation * felt).normalized().z();
  gyro["up_from_floor_rad"] = rounded(std::acos(std::clamp(up, -1.0, 1.0)));
}

}  // namespace plumbline::pipeline
