// SPDX-License-Identifier: BSD-3-Clause
// merge: the maps of several robots as one (docs/method/merging.md; the paper's Algorithm 2). The map of a
// single robot is passed on unchanged.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "plumbline/core/output_file.hpp"
#include "plumbline/mapping/evident.hpp"
#include "plumbline/mapping/merging/merge_server.hpp"
#include "plumbline/maps/stored_maps.hpp"
#include "plumbline/pipeline/meeting_log.hpp"
#include "plumbline/pipeline/robot_recordings.hpp"
#include "robots/picked_merge.hpp"
#include "robots/rig_merge.hpp"
#include "robots/robot_components.hpp"
#include "robots/robot_merge.hpp"
#include "stages/stages.hpp"
#include "summary/sections.hpp"

namespace plumbline::pipeline {
namespace {

constexpr const char* kMeetings = "meetings";

/// Meetings of robots that are mapped at the same time.
class LiveMeetings {
 public:
  LiveMeetings(const mapping::MapFusionOptions& options, int lag, const RunContext& context)
      : recordings_(*context.input.recordings),
        server_(options, lag, *context.executor),
        log_(context.output_folder, *context.log) {
    for (const RobotInfo& robot : recordings_.robots()) {
      server_.join({{robot.number, robot.camera.color}});
      names_.push_back(robot.name);
    }
  }

  /// `track`: null for a frame without a pose.
  core::Result<void> add(const TrackedFrame* track, std::size_t frame) {
    const auto number = static_cast<std::int64_t>(frame);

    if (track != nullptr && track->map != nullptr) {
      made_s_[track->keyframe] = recordings_.time_of(frame);
      server_.add(track->map, track->keyframe, number);
    }
    return note(server_.commit(number), frame);
  }
  core::Result<void> finish(bool pictures) {
    if (auto noted = note(server_.finish(), recordings_.size() - 1); !noted) return noted;
    return pictures ? log_.draw() : core::Result<void>();
  }

  [[nodiscard]] Json section() const {
    Json list = Json::array();
    for (const Meeting& meeting : log_.meetings()) {
      list.push_back({{"number", meeting.number},
                      {"a", meeting.a},
                      {"b", meeting.b},
                      {"time_s", rounded(meeting.time_s)},
                      {"frame", meeting.frame},
                      {"taken_back", meeting.taken_back}});
    }
    return list;
  }
  /// Adds the times at which merged robots met, and at which they could have.
  void date(RobotMerge& merge) const {
    const auto when = met_s_.find({merge.evidence.a, merge.evidence.b});
    if (when != met_s_.end()) merge.time_s = when->second;
    merge.evident_s = mapping::evident_s(merge.evidence, made_s_);
  }

 private:
  /// Events that are reported with a frame of the run.
  core::Result<void> note(const std::vector<mapping::MeetingEvent>& events, std::size_t frame) {
    for (const mapping::MeetingEvent& event : events) {
      const double time_s = recordings_.time_of(frame);
      if (event.step == mapping::MeetingStep::kMet) met_s_[{event.a, event.b}] = time_s;
      if (event.step == mapping::MeetingStep::kTakenBack) met_s_.erase({event.a, event.b});
      auto noted = log_.note(event, names_, fmt::format("after {:.1f} s", time_s), time_s);
      if (!noted) return noted;
    }
    return {};
  }

  const RobotRecordings& recordings_;
  mapping::MergeServer server_;
  MeetingLog log_;
  std::vector<std::string> names_;                               ///< by robot
  std::map<core::KeyframeId, double> made_s_;                    ///< keyframes
  std::map<std::pair<std::size_t, std::size_t>, double> met_s_;  ///< robots
};

class MergeStage : public Stage {
 public:
  void declare(core::OptionTable& table) override {
    options_.declare(table);
    table.boolean("online", online_, "Find overlaps while robots map, not only at the end");
    table.integer("lag", lag_, {0, 10000}, "",
                  "Number of frames of all robots after which an overlap found by a keyframe is reported");
    table.boolean("pictures", pictures_, "Draw the maps of robots that met, in meetings/*/map.png");
  }
  [[nodiscard]] std::vector<std::string> files() const override {
    return online_ ? std::vector<std::string>{kMeetings} : std::vector<std::string>{};
  }
  [[nodiscard]] bool takes_rig() const override { return true; }

  core::Result<void> start(const RunContext& context) override {
    context_ = &context;
    if (context.input.recordings != nullptr && context.input.recordings->robots().size() > 1 && online_)
      live_.emplace(options_, lag_, context);
    return {};
  }

  core::Result<void> process(StageIo& io) override {
    return live_ ? live_->add(io.input<TrackedFrame>("track").get(), io.frame()) : core::Result<void>();
  }

  core::Result<void> finish(StageIo& io) override {
    const auto maps = io.input<RobotMaps>("maps");
    if (live_) {
      if (auto finished = live_->finish(pictures_); !finished) return finished;
    }

    // A single robot's map has nothing to be compared with, and a map that was only adjusted keeps its poses.
    if (maps->maps.size() == 1 && maps->maps.front().robots.size() == 1 &&
        context_->input.stored_maps == nullptr) {
      merged_.map = std::make_shared<MapResult>();
      merged_.map->map = maps->maps.front().map;
      merged_.map->frame_poses = maps->maps.front().frame_poses;
      merged_.map->robots = maps->maps.front().robots;
      take_poses_from_map(*merged_.map);
    } else if (context_->input.stored_maps != nullptr && context_->input.stored_maps->replaced()) {
      merged_.map = kept_map(maps->maps, context_->input.stored_maps->parts().front().state);
    } else if (auto merged = merge(maps->maps); !merged) {
      return merged;
    }

    note_components(maps->maps);
    merged_.map->frame_columns = maps->frame_columns;
    merged_.map->frames = maps->frames;
    io.output<MapResult>("map", merged_.map);
    return {};
  }

  void report(Json& summary) const override {
    const MapResult& result = *merged_.map;
    summary["keyframes"] = result.map->keyframe_count();
    summary["landmarks"] = {{"points", result.map->point_count()}, {"lines", result.lines.size()}};
    for (const RobotMerge& merge : merged_.merges) summary["merges"].push_back(section_of(merge));
    if (live_) summary["meetings"] = live_->section();
    if (rig_) summary["rig"] = section_of(*rig_);
    for (const ComponentFate& component : components_)
      summary["components"]["list"].push_back(section_of(component));
    add(summary["path"]["refused_adjustments"], merged_.refused);
    if (context_->input.stored_maps != nullptr) report_stored_frames(result, summary);
  }
  void doubt(const Json& summary, std::vector<Doubt>& reasons) const override {
    if (context_->input.stored_maps != nullptr) doubt_lost_frames(summary, reasons);
    doubt_components_apart(summary, reasons);
    if (!merged_.unconnected.empty())
      reasons.push_back({Doubt::About::kUnconnectedMaps, merged_.unconnected});
  }

 private:
  /// Frames of finished maps are not read; they are counted from their poses.
  static void report_stored_frames(const MapResult& result, Json& summary) {
    const auto tracked = std::count_if(result.frame_poses.begin(), result.frame_poses.end(),
                                       [](const auto& frame) { return frame.tracked; });

    // Robots of which nothing is in the map count as well.
    std::size_t all = result.frame_poses.size();
    std::set<std::int32_t> counted;
    for (const RobotInfo& robot : result.robots) counted.insert(robot.number);
    for (const auto& component : result.apart) {
      if (counted.insert(component->robots.front().number).second) all += component->frame_poses.size();
    }

    FrameCounts frames(summary);
    frames.read = frames.available = all;
    frames.tracked = static_cast<std::size_t>(tracked);
    frames.lost = all - frames.tracked;
    frames.write(summary);
  }
  /// Records the outcome for components that were not joined while their robot mapped.
  void note_components(const std::vector<RobotMap>& parts) {
    for (const RobotMap& part : parts) {
      if (!part.component) continue;
      ComponentFate component;
      component.name = part.name;
      component.keyframes = part.map->keyframe_count();
      component.frames = static_cast<std::size_t>(std::count_if(
          part.frame_poses.begin(), part.frame_poses.end(), [](const auto& frame) { return frame.tracked; }));

      const auto& apart = merged_.map->apart;
      component.joined = std::none_of(apart.begin(), apart.end(),
                                      [&](const auto& other) { return other->name == part.name; });

      // Each comparison with another map may have failed for a reason of its own, so all are listed.
      for (const RobotMerge& merge : merged_.merges) {
        if (merge.a != part.name && merge.b != part.name) continue;
        component.agreeing = std::max(component.agreeing, merge.evidence.consistency.agreeing);
        const std::string& other = merge.a == part.name ? merge.b : merge.a;
        if (!component.joined)
          component.why_not +=
              (component.why_not.empty() ? "" : "; ") + other + ": " + merge.evidence.refused;
      }

      components_.push_back(std::move(component));
    }
  }
  /// Merges that need no place that two maps share: by picks of a user, or by a rig.
  core::Result<std::vector<KnownMerge>> known_merges(const std::vector<RobotMap>& maps) {
    std::vector<KnownMerge> known;
    if (const maps::StoredMaps* stored = context_->input.stored_maps;
        stored != nullptr && !stored->picks().empty()) {
      auto picked = picked_merge(*stored, maps, *context_->executor);
      if (!picked) return tl::unexpected(picked.error());
      known.push_back({std::move(*picked), KnownMerge::By::kPicks});
    }
    if (context_->input.rig == nullptr) return known;

    // The poses of the cameras are a result of their own, with which the next run need not find them.
    auto rig = rig_merge(*context_->input.rig, maps, *context_->log);
    if (!rig) return tl::unexpected(rig.error());
    for (mapping::MergeEvidence& merge : rig->merges)
      known.push_back({std::move(merge), KnownMerge::By::kRig});
    rig_ = std::move(*rig);
    if (auto ok = core::write_file(context_->output_folder / "rig.yaml", to_yaml(*rig_)); !ok)
      return tl::unexpected(ok.error());
    return known;
  }
  core::Result<void> merge(const std::vector<RobotMap>& maps) {
    std::size_t anchor = maps.size();
    if (!context_->input.anchor.empty())
      anchor = *context_->input.stored_maps->find_part(context_->input.anchor);
    if (context_->input.into) anchor = 0;
    const auto known = known_merges(maps);
    if (!known) return tl::unexpected(known.error());
    merged_ = merge_robots(maps, anchor, options_, *context_->executor, *context_->log, *known);
    for (RobotMerge& merge : merged_.merges) {
      if (live_) live_->date(merge);
    }
    return {};
  }

  const RunContext* context_ = nullptr;
  mapping::MapFusionOptions options_;
  bool online_ = true;
  bool pictures_ = true;
  int lag_ = 10;
  std::optional<LiveMeetings> live_;
  MergedRobots merged_;
  std::optional<RigMerge> rig_;
  std::vector<ComponentFate> components_;
};

}  // namespace

StageType merge_stage() {
  return stage_type<MergeStage>(
      "merge",
      "Finds where maps of several robots overlap, transforms them into one frame and adjusts them together",
      Mode::kSerial, {{"track", track_port(), false}, {"maps", maps_port()}}, {{"map", map_port()}});
}

}  // namespace plumbline::pipeline
