// SPDX-License-Identifier: BSD-3-Clause
// poses: no tracking, poses come from a file or from the recording's own truth.
#include <fmt/format.h>

#include <memory>
#include <optional>
#include <utility>

#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/dataset/trajectory_io.hpp"
#include "plumbline/pipeline/robot_recordings.hpp"
#include "plumbline/pipeline/summary.hpp"
#include "stages.hpp"

namespace plumbline::pipeline {
namespace {

class PosesStage : public Stage {
 public:
  void declare(core::OptionTable& table) override {
    table.text("file", file_,
               "Poses in TUM format (stamp tx ty tz qx qy qz qw); empty: the recording's own truth");
    table.number("max_gap", max_gap_s_, {0.0, 10.0}, "s",
                 "Poses are interpolated; a frame further than this from the nearest pose has none");
    table.number("keyframe_distance", keyframe_distance_m_, {0.0, 10.0}, "m", "A keyframe after this way");
    table.number("keyframe_angle", keyframe_angle_rad_, {0.0, 3.2}, "rad", "A keyframe after this turn");
  }

  core::Result<void> start(const RunContext& context) override {
    if (context.recordings->robots().size() > 1)
      return core::usage_error("known poses are those of one recording; map one at a time");
    if (file_.empty()) {
      const auto truth = context.source->truth();
      if (!truth || truth->empty()) {
        return core::input_error(
            fmt::format("{}: the recording has no poses of its own; name a file with --set poses.file=FILE",
                        context.source->name()));
      }
      poses_ = *truth;
      return {};
    }
    auto poses = dataset::read_trajectory(file_);
    if (!poses) return tl::unexpected<core::Error>(poses.error());
    poses_ = std::move(*poses);
    return {};
  }

  core::Result<void> process(StageIo& io) override {
    const auto frame = io.input<sensor::RgbdFrame>("frame");
    const std::optional<geometry::Rigid3> pose = geometry::pose_at(poses_, frame->stamp, max_gap_s_);
    const std::string stamp = fmt::format("{:.6f}", frame->stamp);
    if (!pose) {
      map_.frames.push_back({io.frame(), "lost", stamp + ","});
      return {};
    }
    auto tracked = std::make_shared<TrackedFrame>();
    tracked->stamp = frame->stamp;
    tracked->depth_from_camera = depth_from_camera(*frame, *pose);
    map_.trajectory.push_back({frame->stamp, *pose});
    if (map_.keyframes.empty() || is_new_view(map_.keyframes.back().world_from_camera, *pose)) {
      tracked->keyframe = {0, static_cast<std::int32_t>(map_.keyframes.size())};
      map_.keyframes.push_back({tracked->keyframe, frame->stamp, *pose});
    }
    map_.frames.push_back({io.frame(), "tracked", stamp + (tracked->keyframe.valid() ? ",1" : ",0")});
    io.output<TrackedFrame>("track", tracked);
    return {};
  }

  core::Result<void> finish(StageIo& io) override {
    map_.frame_columns = "stamp,keyframe";
    io.output<MapResult>("map", std::make_shared<MapResult>(map_));
    return {};
  }

  void summarise(RunSummary& summary) const override {
    count_frames(map_.frames, summary);
    summary.keyframes = map_.keyframes.size();
  }

 private:
  /// Between the moments of both images; identity where no pose is near that of the depth image.
  [[nodiscard]] geometry::Rigid3 depth_from_camera(const sensor::RgbdFrame& frame,
                                                   const geometry::Rigid3& world_from_camera) const {
    if (frame.depth_stamp == frame.stamp) return {};
    const auto world_from_depth = geometry::pose_at(poses_, frame.depth_stamp, max_gap_s_);
    return world_from_depth ? world_from_depth->inverse() * world_from_camera : geometry::Rigid3{};
  }
  [[nodiscard]] bool is_new_view(const geometry::Rigid3& last, const geometry::Rigid3& now) const {
    const geometry::Rigid3 step = last.inverse() * now;
    return step.translation.norm() > keyframe_distance_m_ ||
           geometry::rotation_angle(step.rotation) > keyframe_angle_rad_;
  }

  std::string file_;
  double max_gap_s_ = 0.02;
  double keyframe_distance_m_ = 0.05;
  double keyframe_angle_rad_ = 0.05;
  geometry::Trajectory poses_;
  MapResult map_;
};

}  // namespace

StageType poses_stage() {
  return {"poses",
          "Takes poses from a file or the recording's truth instead of tracking",
          Mode::kSerial,
          {{"frame", frame_port()}},
          {{"track", track_port()}, {"map", map_port()}},
          [] { return std::make_unique<PosesStage>(); }};
}

}  // namespace plumbline::pipeline
