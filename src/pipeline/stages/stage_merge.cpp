// SPDX-License-Identifier: BSD-3-Clause
// merge: the maps of several robots as one (docs/method/merging.md; the paper's Algorithm 2). One robot's map
// goes on as it is.
#include <fmt/format.h>

#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "plumbline/mapping/merge_server.hpp"
#include "plumbline/pipeline/robot_recordings.hpp"
#include "plumbline/pipeline/stored_maps.hpp"
#include "plumbline/pipeline/summary.hpp"
#include "stages/robot_merge.hpp"
#include "stages/stages.hpp"

namespace plumbline::pipeline {
namespace {

class MergeStage : public Stage {
 public:
  void declare(core::OptionTable& table) override {
    options_.declare(table);
    table.boolean("online", online_, "Look for overlaps while robots map, not only at the end");
  }

  core::Result<void> start(const RunContext& context) override {
    context_ = &context;
    if (context.recordings == nullptr || context.recordings->robots().size() < 2 || !online_) return {};
    std::vector<mapping::Cameras> cameras;
    for (const RobotInfo& robot : context.recordings->robots())
      cameras.push_back({{robot.number, robot.camera.color}});
    end_.emplace(options_, cameras, *context.executor);
    return {};
  }

  core::Result<void> process(StageIo& io) override {
    const auto track = io.input<TrackedFrame>("track");
    if (!end_ || track == nullptr || track->map == nullptr) return {};
    const std::vector<RobotInfo>& robots = context_->recordings->robots();
    for (const mapping::MergeEvidence& merge : end_->add(track->map, track->keyframe)) {
      const double time = context_->recordings->time_of(io.frame());
      times_[{merge.a, merge.b}] = time;
      context_->log->info(fmt::format("{} and {} have met after {:.1f} s: {} keyframes agree to {:.0f} mm",
                                      robots[merge.a].name, robots[merge.b].name, time,
                                      merge.consistency.agreeing, 1e3 * merge.alignment.spread_m));
    }
    return {};
  }

  core::Result<void> finish(StageIo& io) override {
    const auto maps = io.input<RobotMaps>("maps");
    end_.reset();
    std::shared_ptr<MapResult> result;
    if (maps->maps.size() == 1 && maps->maps.front().robots.size() == 1 && context_->stored_maps == nullptr) {
      result = std::make_shared<MapResult>();
      result->map = maps->maps.front().map;
      result->frame_poses = maps->maps.front().frame_poses;
      take_poses_from_map(*result);
    } else {
      result = merged(maps->maps);
    }
    result->frame_columns = maps->frame_columns;
    result->frames = maps->frames;
    result_ = result;
    io.output<MapResult>("map", result_);
    return {};
  }

  void summarise(RunSummary& summary) const override {
    summary.keyframes = result_->map->keyframe_count();
    summary.points = result_->map->point_count();
    summary.lines = result_->lines.size();
    summary.merges = merges_;
    summary.unconnected = unconnected_;
    summary.path.refused += refused_;
    if (context_->stored_maps == nullptr) return;
    for (const maps::FramePose& frame : result_->frame_poses)
      ++(frame.tracked ? summary.frames.tracked : summary.frames.lost);
    summary.frames.read = summary.frames.available = result_->frame_poses.size();
  }

 private:
  std::shared_ptr<MapResult> merged(const std::vector<RobotMap>& maps) {
    std::size_t anchor = maps.size();
    if (!context_->anchor.empty()) anchor = *context_->stored_maps->find_part(context_->anchor);
    MergedRobots all = merge_robots(maps, anchor, options_, *context_->executor, *context_->log);
    merges_ = std::move(all.merges);
    for (RunSummary::Merge& merge : merges_) {
      const auto when = times_.find({merge.evidence.a, merge.evidence.b});
      if (when != times_.end()) merge.time_s = when->second;
    }
    unconnected_ = std::move(all.unconnected);
    refused_ = all.refused;
    return all.map;
  }

  const RunContext* context_ = nullptr;
  mapping::MapFusionOptions options_;
  bool online_ = true;
  std::optional<mapping::MergeServer> end_;
  std::map<std::pair<std::size_t, std::size_t>, double>
      times_;  ///< when two robots' maps were found to overlap
  std::shared_ptr<const MapResult> result_;
  std::vector<RunSummary::Merge> merges_;
  std::string unconnected_;
  std::size_t refused_ = 0;
};

}  // namespace

StageType merge_stage() {
  return {"merge",
          "Finds where maps of several robots overlap, lays them into one frame and adjusts them together",
          Mode::kSerial,
          {{"track", track_port(), false}, {"maps", maps_port()}},
          {{"map", map_port()}},
          [] { return std::make_unique<MergeStage>(); }};
}

}  // namespace plumbline::pipeline
