// SPDX-License-Identifier: BSD-3-Clause
// poses: no tracking, poses come from a file or from the recording's own truth.
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>

#include "options/convention_option.hpp"
#include "plumbline/core/csv.hpp"
#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/dataset/trajectory_io.hpp"
#include "plumbline/diagnose/signs.hpp"
#include "plumbline/pipeline/robot_recordings.hpp"
#include "stages/stages.hpp"
#include "summary/sections.hpp"
#include "summary/signs.hpp"

namespace plumbline::pipeline {
namespace {

class PosesStage : public Stage {
 public:
  void declare(core::OptionTable& table) override {
    table.text("file", file_,
               "Poses in TUM format (stamp tx ty tz qx qy qz qw); {robot} in the name stands for each "
               "robot's name; empty: the recordings' own truth",
               core::EmptyValue::kAllowed);
    declare_convention(table, "are", are_, "the poses");
    table.number("max_gap", max_gap_s_, {0.0, 10.0}, "s",
                 "Poses are interpolated; frames further than this from the nearest pose have none");
    table.number("keyframe_distance", keyframe_distance_m_, {0.0, 10.0}, "m", "Distance between keyframes");
    table.number("keyframe_angle", keyframe_angle_rad_, {0.0, 3.2}, "rad", "Rotation between keyframes");
  }

  core::Result<void> start(const RunContext& context) override {
    recordings_ = context.input.recordings;
    ways_.resize(recordings_->robots().size());

    // One file for several recordings would give all robots the same path.
    if (several() && !file_.empty() && file_.find(kRobot) == std::string::npos) {
      return core::usage_error(fmt::format(
          "{}: are poses of one recording; write {} where the file's name has the robot's: poses/{}.txt",
          file_, kRobot, kRobot));
    }
    for (const RobotInfo& robot : recordings_->robots()) {
      auto poses = poses_of(robot);
      if (!poses) return tl::unexpected(poses.error());
      if (auto near = near_origin(file_of(robot), *poses); !near) return near;

      // The distance from the origin is checked before the convention is applied, so that the message shows
      // the numbers of the file.
      for (geometry::StampedPose& pose : *poses)
        pose.world_from_camera = geometry::read_by(are_, pose.world_from_camera);
      Way& way = ways_[static_cast<std::size_t>(robot.number)];
      way.poses = std::move(*poses);
      way.samples = std::make_unique<diagnose::Samples>(
          robot.camera.color, recordings_->live() != nullptr ? 0 : recordings_->frames_of(robot.number));
    }
    log_ = context.log;
    return {};
  }

  core::Result<void> process(StageIo& io) override {
    const auto frame = io.input<sensor::RgbdFrame>("frame");
    const RobotInfo& robot = recordings_->robot(recordings_->robot_of(io.frame()));
    Way& way = ways_[static_cast<std::size_t>(robot.number)];
    way.samples->add(*frame);

    const std::optional<geometry::Rigid3> pose = geometry::pose_at(way.poses, frame->stamp, max_gap_s_);
    const std::string stamp =
        fmt::format("{}{:.6f}", several() ? core::csv_field(robot.name) + "," : "", frame->stamp);

    // Depth of a frame without a pose near its stamp would be fused at a guess: the frame counts as lost.
    if (!pose) {
      map_.frames.push_back({io.frame(), FrameState::kLost, stamp + ","});
      return {};
    }

    auto tracked = std::make_shared<TrackedFrame>();
    tracked->robot = robot.number;
    tracked->stamp = frame->stamp;
    tracked->depth_from_camera = depth_from_camera(way.poses, *frame, *pose);
    tracked->frame = {robot.number, way.frames++};
    map_.trajectory.push_back({frame->stamp, *pose});
    map_.trajectory_ids.push_back(tracked->frame);

    // Keyframes are chosen by motion alone, as no tracker tells how much of a view is known.
    if (way.keyframes == 0 || is_new_view(way.last, *pose)) {
      tracked->keyframe = {robot.number, way.keyframes++};
      way.last = *pose;
      map_.keyframes.push_back({tracked->keyframe, frame->stamp, *pose});
    }

    map_.frames.push_back(
        {io.frame(), FrameState::kTracked, stamp + (tracked->keyframe.valid() ? ",1" : ",0")});
    io.output<TrackedFrame>("track", tracked);
    return {};
  }

  core::Result<void> finish(StageIo& io) override {
    for (const RobotInfo& robot : recordings_->robots()) {
      Way& way = ways_[static_cast<std::size_t>(robot.number)];
      add_signs(several() ? robot.name : "", {diagnose::pose_sign(*way.samples, way.poses)}, *log_, signs_);
      way.samples.reset();
    }
    map_.frame_columns = several() ? "robot,stamp,keyframe" : "stamp,keyframe";
    if (several()) map_.robots = recordings_->robots();
    std::sort(map_.keyframes.begin(), map_.keyframes.end(),
              [](const maps::KeyframePose& a, const maps::KeyframePose& b) { return a.id < b.id; });
    io.output<MapResult>("map", std::make_shared<MapResult>(map_));
    return {};
  }

  [[nodiscard]] bool takes_given_poses() const override { return true; }
  void report(Json& summary) const override {
    FrameCounts frames(summary);
    frames.count(map_.frames);
    frames.write(summary);
    report_signs(signs_, summary);
    summary["keyframes"] = map_.keyframes.size();
    for (const RobotInfo& robot : map_.robots) {
      const Way& way = ways_[static_cast<std::size_t>(robot.number)];
      summary["robots"].push_back({{"name", robot.name}, {"keyframes", way.keyframes}});
    }
  }
  void doubt(const Json& summary, std::vector<Doubt>& reasons) const override {
    doubt_lost_frames(summary, reasons);
    doubt_signs(signs_, reasons);
  }

 private:
  static constexpr const char* kRobot = "{robot}";
  /// Poses of one robot, and counts of its frames so far.
  struct Way {
    geometry::Trajectory poses;
    std::unique_ptr<diagnose::Samples> samples;
    std::int32_t frames = 0;
    std::int32_t keyframes = 0;
    geometry::Rigid3 last;  ///< pose of the last keyframe
  };
  [[nodiscard]] bool several() const { return ways_.size() > 1; }

  /// The robot's file of poses; its recording, if they are that one's own.
  [[nodiscard]] std::string file_of(const RobotInfo& robot) const {
    std::string file = file_.empty() ? robot.name : file_;
    if (const auto at = file.find(kRobot); at != std::string::npos) {
      file.replace(at, std::string(kRobot).size(), robot.name);
    }
    return file;
  }
  [[nodiscard]] core::Result<geometry::Trajectory> poses_of(const RobotInfo& robot) const {
    if (!file_.empty()) return dataset::read_trajectory(file_of(robot));
    const auto truth = recordings_->truth_of(robot.number);
    if (truth && !truth->empty()) return *truth;
    return core::input_error(fmt::format(
        "{}: the recording has no poses of its own; name a file with --set poses.file=FILE", robot.name));
  }
  /// Floats hold a millimetre, and the map voxels of 1 cm, up to 2^20 cm from the origin.
  [[nodiscard]] static core::Result<void> near_origin(const std::string& file,
                                                      const geometry::Trajectory& poses) {
    constexpr double kFarthest_m = 10400.0;
    for (const geometry::StampedPose& pose : poses) {
      const Eigen::Vector3d& at = pose.world_from_camera.translation;
      if (at.cwiseAbs().maxCoeff() <= kFarthest_m) continue;
      return core::input_error(fmt::format(
          "{}: the pose at {:.6f} s lies at {:.0f} {:.0f} {:.0f} m, and clouds hold a millimetre only within "
          "about 10 km of the origin; subtract an offset from all poses, and let export add it again with "
          "--epsg and --origin",
          file, pose.stamp, at.x(), at.y(), at.z()));
    }
    return {};
  }
  /// Motion between the stamps of both images; identity if no pose is near the stamp of the depth image.
  [[nodiscard]] geometry::Rigid3 depth_from_camera(const geometry::Trajectory& poses,
                                                   const sensor::RgbdFrame& frame,
                                                   const geometry::Rigid3& world_from_camera) const {
    if (frame.depth_stamp == frame.stamp) return {};
    const auto world_from_depth = geometry::pose_at(poses, frame.depth_stamp, max_gap_s_);
    return world_from_depth ? world_from_depth->inverse() * world_from_camera : geometry::Rigid3{};
  }
  [[nodiscard]] bool is_new_view(const geometry::Rigid3& last, const geometry::Rigid3& now) const {
    const geometry::Rigid3 step = last.inverse() * now;
    return step.translation.norm() > keyframe_distance_m_ ||
           geometry::rotation_angle(step.rotation) > keyframe_angle_rad_;
  }

  std::string file_;
  geometry::PoseConvention are_ = geometry::PoseConvention::kWorldFromCamera;
  double max_gap_s_ = 0.02;
  double keyframe_distance_m_ = 0.05;
  double keyframe_angle_rad_ = 0.05;
  const RobotRecordings* recordings_ = nullptr;
  std::vector<Way> ways_;  ///< by robot
  std::vector<diagnose::Sign> signs_;
  core::Log* log_ = nullptr;
  MapResult map_;
};

}  // namespace

StageType poses_stage() {
  return stage_type<PosesStage>(
      "poses", "Takes poses from files or the recordings' truth instead of tracking", Mode::kSerial,
      {{"frame", frame_port()}}, {{"track", track_port()}, {"map", map_port()}});
}

}  // namespace plumbline::pipeline
