// SPDX-License-Identifier: BSD-3-Clause
// merge: the maps of several robots as one (docs/method/merging.md; the paper's Algorithm 2). One robot's map
// goes on as it is.
#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "plumbline/mapping/merge_server.hpp"
#include "plumbline/maps/stored_maps.hpp"
#include "plumbline/pipeline/meeting_log.hpp"
#include "plumbline/pipeline/robot_recordings.hpp"
#include "plumbline/pipeline/summary.hpp"
#include "stages/robot_merge.hpp"
#include "stages/stages.hpp"

namespace plumbline::pipeline {
namespace {

constexpr const char* kMeetings = "meetings";

/// When the fifth keyframe of those that agree was there on both sides, or the last of fewer.
double evident_s(const mapping::MergeEvidence& merge, const std::map<core::KeyframeId, double>& times) {
  constexpr std::size_t kEnough = 5;
  std::map<std::int32_t, std::set<double>> sides;
  for (const mapping::VerifiedPair& pair : merge.pairs) {
    for (const core::KeyframeId id : {pair.query, pair.match}) {
      if (const auto made = times.find(id); made != times.end()) sides[id.robot].insert(made->second);
    }
  }
  double latest = -1.0;
  for (const auto& [robot, made] : sides)
    latest = std::max(
        latest, *std::next(made.begin(), static_cast<std::ptrdiff_t>(std::min(kEnough, made.size()) - 1)));
  return latest;
}

class MergeStage : public Stage {
 public:
  void declare(core::OptionTable& table) override {
    options_.declare(table);
    table.boolean("online", online_, "Look for overlaps while robots map, not only at the end");
    table.integer("lag", lag_, {0, 10000}, "",
                  "Frames of all robots until what a keyframe shows of an overlap is told");
    table.boolean("pictures", pictures_, "Draw the maps of robots that met, in meetings/*/map.png");
  }
  [[nodiscard]] std::vector<std::string> files() const override {
    return online_ ? std::vector<std::string>{kMeetings} : std::vector<std::string>{};
  }

  core::Result<void> start(const RunContext& context) override {
    context_ = &context;
    if (context.recordings == nullptr || context.recordings->robots().size() < 2 || !online_) return {};
    server_.emplace(options_, lag_, *context.executor);
    for (const RobotInfo& robot : context.recordings->robots()) {
      server_->join({{robot.number, robot.camera.color}});
      names_.push_back(robot.name);
    }
    meetings_.emplace(context.output_folder, *context.log);
    return {};
  }

  core::Result<void> process(StageIo& io) override {
    const auto track = io.input<TrackedFrame>("track");
    if (!server_) return {};
    const auto frame = static_cast<std::int64_t>(io.frame());
    if (track != nullptr && track->map != nullptr) {
      times_[track->keyframe] = context_->recordings->time_of(io.frame());
      server_->add(track->map, track->keyframe, frame);
    }
    return note(server_->commit(frame), io.frame());
  }

  core::Result<void> finish(StageIo& io) override {
    const auto maps = io.input<RobotMaps>("maps");
    if (server_) {
      if (auto noted = note(server_->finish(), context_->recordings->size() - 1); !noted) return noted;
      server_.reset();
      if (pictures_) {
        if (auto drawn = meetings_->draw(); !drawn) return drawn;
      }
    }
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
    if (meetings_) summary.meetings = meetings_->meetings();
    summary.unconnected = unconnected_;
    summary.path.refused += refused_;
    if (context_->stored_maps == nullptr) return;
    for (const maps::FramePose& frame : result_->frame_poses)
      ++(frame.tracked ? summary.frames.tracked : summary.frames.lost);
    summary.frames.read = summary.frames.available = result_->frame_poses.size();
  }

 private:
  /// Events that are reported with a frame of the run.
  core::Result<void> note(const std::vector<mapping::MeetingEvent>& events, std::size_t frame) {
    for (const mapping::MeetingEvent& event : events) {
      const double time_s = context_->recordings->time_of(frame);
      if (event.step == mapping::MeetingStep::kMet) met_s_[{event.a, event.b}] = time_s;
      if (event.step == mapping::MeetingStep::kTakenBack) met_s_.erase({event.a, event.b});
      auto noted = meetings_->note(event, names_, fmt::format("after {:.1f} s", time_s), time_s);
      if (!noted) return noted;
    }
    return {};
  }

  std::shared_ptr<MapResult> merged(const std::vector<RobotMap>& maps) {
    std::size_t anchor = maps.size();
    if (!context_->anchor.empty()) anchor = *context_->stored_maps->find_part(context_->anchor);
    MergedRobots all = merge_robots(maps, anchor, options_, *context_->executor, *context_->log);
    merges_ = std::move(all.merges);
    for (RunSummary::Merge& merge : merges_) {
      const auto when = met_s_.find({merge.evidence.a, merge.evidence.b});
      if (when != met_s_.end()) merge.time_s = when->second;
      merge.evident_s = evident_s(merge.evidence, times_);
    }
    unconnected_ = std::move(all.unconnected);
    refused_ = all.refused;
    return all.map;
  }

  const RunContext* context_ = nullptr;
  mapping::MapFusionOptions options_;
  bool online_ = true;
  bool pictures_ = true;
  int lag_ = 10;
  std::optional<mapping::MergeServer> server_;
  std::vector<std::string> names_;  ///< by robot
  std::optional<MeetingLog> meetings_;
  std::map<core::KeyframeId, double> times_;                     ///< when keyframes were made
  std::map<std::pair<std::size_t, std::size_t>, double> met_s_;  ///< and robots met
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
