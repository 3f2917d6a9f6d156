// SPDX-License-Identifier: BSD-3-Clause
// robots: the SLAM of several robots side by side, and the end that fuses their maps (METHOD section 6,
// Algorithm 2).
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <memory>
#include <utility>

#include "plumbline/mapping/fusion_end.hpp"
#include "plumbline/mapping/slam.hpp"
#include "plumbline/pipeline/robot_recordings.hpp"
#include "plumbline/pipeline/summary.hpp"
#include "robot_merge.hpp"
#include "stages.hpp"
#include "track_rows.hpp"

namespace plumbline::pipeline {
namespace {

class RobotsStage : public Stage {
 public:
  void declare(core::OptionTable& table) override {
    slam_.declare(table);
    fusion_.declare_decision(table, "merge.");
    table.boolean("online", online_, "Look for overlaps while the robots map, not only at the end");
  }

  core::Result<void> start(const RunContext& context) override {
    context_ = &context;
    recordings_ = context.recordings;
    if (recordings_ == nullptr) {
      return core::usage_error("a pipeline with a robots stage maps several recordings: name them all");
    }
    fusion_.verify = slam_.loops.verify;
    std::vector<mapping::MapPart> maps;
    for (const RobotInfo& robot : recordings_->robots()) {
      slams_.push_back(std::make_unique<mapping::Slam>(slam_, robot.camera.color, robot.number,
                                                       *context.executor, *context.log));
      slams_.back()->set_shutter(robot.camera.readout_s);
      maps.push_back({&slams_.back()->map(), {{robot.number, robot.camera.color}}});
    }
    end_ = std::make_unique<mapping::FusionEnd>(fusion_, std::move(maps), *context.executor);
    return {};
  }

  core::Result<void> process(StageIo& io) override {
    const auto frame = io.input<sensor::RgbdFrame>("frame");
    const auto features = io.input<features::FrameFeatures>("features");
    const std::int32_t robot = recordings_->robot_of(io.frame());
    mapping::Slam& slam = *slams_[static_cast<std::size_t>(robot)];
    const mapping::FrameReport report = slam.process(*frame, features);
    rows_.push_back({io.frame(), tracking::to_string(report.state),
                     fmt::format("{},{}", recordings_->robots()[static_cast<std::size_t>(robot)].name,
                                 row_columns(report))});
    auto tracked = std::make_shared<TrackedFrame>();
    tracked->keyframe = report.keyframe;
    tracked->stamp = report.stamp;
    tracked->depth_from_camera = report.depth_from_camera;
    tracked->row = rows_.back();
    if (!slam.frame_poses().empty()) tracked->pose = slam.frame_poses().back();
    io.output<TrackedFrame>("track", tracked);
    if (online_ && report.keyframe.valid()) look_for_overlaps(report.keyframe, io.frame());
    return {};
  }

  core::Result<void> finish(StageIo& io) override {
    std::vector<RobotPart> parts;
    for (const RobotInfo& robot : recordings_->robots()) {
      mapping::Slam& slam = *slams_[static_cast<std::size_t>(robot.number)];
      slam.finish();
      if (slam.map().keyframe_count() == 0) {
        return core::input_error(
            fmt::format("{}: no frame could begin a map; leave this recording out", robot.name));
      }
      parts.push_back(
          {robot.name, {&slam.map(), {{robot.number, robot.camera.color}}}, {robot}, &slam.frame_poses()});
    }
    const core::Executor& executor = *context_->executor;
    mapping::OverlapFinder places = learn_places(parts, fusion_);
    merged_ = merge_robots(parts, places, parts.size(), fusion_, executor, *context_->log);
    for (RunSummary::Merge& merge : merged_.merges) {
      const auto when = times_.find({merge.evidence.a, merge.evidence.b});
      if (when != times_.end()) merge.time_s = when->second;
    }
    auto map = std::make_shared<MapResult>(*merged_.map);
    map->frame_columns = std::string("robot,") + kRowColumns;
    map->frames = rows_;
    merged_.map = map;
    io.output<MapResult>("map", map);
    return {};
  }

  void summarise(RunSummary& summary) const override {
    count_frames(rows_, summary);
    summary.keyframes = merged_.map->map->keyframe_count();
    summary.points = merged_.map->map->point_count();
    summary.lines = merged_.map->lines.size();
    summary.merges = merged_.merges;
    summary.unconnected = merged_.unconnected;
    summary.path.refused += merged_.refused;
    for (const RobotInfo& robot : recordings_->robots()) {
      const auto r = static_cast<std::size_t>(robot.number);
      const mapping::LoopCounts& loops = slams_[r]->loop_counts();
      summary.loops.candidates += static_cast<std::size_t>(loops.candidates);
      summary.loops.verified += static_cast<std::size_t>(loops.verified);
      summary.loops.accepted += static_cast<std::size_t>(loops.accepted);
      summary.path.refused += static_cast<std::size_t>(slams_[r]->refused());
      summary.robots.push_back({robot.name, slams_[r]->map().keyframe_count()});
    }
  }

 private:
  void look_for_overlaps(core::KeyframeId id, std::size_t frame) {
    const std::vector<RobotInfo>& robots = recordings_->robots();
    for (const mapping::MergeEvidence& merge : end_->add(id)) {
      const double time = recordings_->time_of(frame);
      times_[{merge.a, merge.b}] = time;
      context_->log->info(fmt::format("{} and {} have met after {:.1f} s: {} keyframes agree to {:.0f} mm",
                                      robots[merge.a].name, robots[merge.b].name, time, merge.agreeing,
                                      1e3 * merge.spread_m));
    }
  }

  const RunContext* context_ = nullptr;
  const RobotRecordings* recordings_ = nullptr;
  mapping::SlamOptions slam_;
  mapping::MapFusionOptions fusion_;
  bool online_ = true;
  std::vector<std::unique_ptr<mapping::Slam>> slams_;  ///< by robot
  std::unique_ptr<mapping::FusionEnd> end_;
  std::map<std::pair<std::size_t, std::size_t>, double>
      times_;  ///< when two robots' maps were found to overlap
  std::vector<FrameRow> rows_;
  MergedRobots merged_;
};

}  // namespace

StageType robots_stage() {
  return {"robots",
          "Tracks several cameras side by side, each with a map of its own, and fuses the maps where they "
          "overlap",
          Mode::kSerial,
          {{"frame", frame_port()}, {"features", features_port()}},
          {{"track", track_port()}, {"map", map_port()}},
          [] { return std::make_unique<RobotsStage>(); }};
}

}  // namespace plumbline::pipeline
