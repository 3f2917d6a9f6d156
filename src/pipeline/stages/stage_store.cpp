// SPDX-License-Identifier: BSD-3-Clause
// store: the maps as map.db while the run goes, so that a run that ends early has lost nothing.
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "plumbline/core/version.hpp"
#include "plumbline/maps/fusion_state.hpp"
#include "plumbline/maps/store.hpp"
#include "results/resumed_run.hpp"
#include "stages/stages.hpp"

namespace plumbline::pipeline {
namespace {

class StoreStage : public Stage {
 public:
  void declare(core::OptionTable& table) override {
    table.boolean(
        "enabled", enabled_,
        "Write map.db, the map with its clouds, during the run, so that an interrupted run can be continued");
  }
  [[nodiscard]] std::vector<std::string> files() const override {
    return enabled_ ? std::vector<std::string>{maps::kStoreFile} : std::vector<std::string>{};
  }
  [[nodiscard]] bool keeps_map() const override { return enabled_; }

  core::Result<void> start(const RunContext& context) override {
    if (!enabled_) return {};
    if (context.resumed != nullptr) return take(maps::StoreWriter::resume(context.resumed->store));
    maps::StoreHeader header;
    header.robots = *context.input.robots;
    header.configuration = context.store.configuration;
    header.input = context.input.text;
    header.program_version = core::version();
    // Fusing finished maps always starts anew after an interruption.
    const auto use =
        context.input.stored_maps != nullptr ? maps::StoreUse::kInOneGo : maps::StoreUse::kGrowing;
    return take(maps::StoreWriter::create(context.output_folder / maps::kStoreFile, header, use));
  }

  /// One transaction a keyframe, with what came of its robot since the last one; other clouds have their
  /// own, for stages at the end read them from the file.
  core::Result<void> process(StageIo& io) override {
    if (!writer_) return {};
    const auto track = io.input<TrackedFrame>("track");
    const auto cloud = io.input<KeyframeCloud>("cloud");
    std::vector<maps::StoreCloud> clouds;
    if (cloud != nullptr && (cloud->id.valid() || cloud->frame.valid())) {
      auto waiting = store_cloud_of(*cloud);
      if (!waiting) return tl::unexpected(waiting.error());
      clouds.push_back(std::move(*waiting));
    }
    if (track != nullptr) {
      maps::StoreStep& step = steps_[track->robot];
      step.robot = track->robot;
      step.log.push_back(to_line(track->row));
      if (track->pose) step.frames.push_back(*track->pose);
      if (track->keyframe.valid()) return add(std::exchange(step, {}), *track, std::move(clouds));
    }
    return clouds.empty() ? core::Result<void>() : writer_->add_cloud(clouds.front());
  }

  core::Result<void> finish(StageIo& io) override {
    const auto map = io.input<MapResult>("map");
    if (!writer_ || map->map == nullptr) return {};
    maps::ResultFrame frame;
    if (const auto dense = io.input<DenseCloud>("result")) {
      frame = {dense->output_from_map, dense->upright};
      if (dense->state != nullptr) {
        if (auto kept = writer_->attach(maps::kFusionAttachment, to_bytes(*dense->state)); !kept) return kept;
      }
    }
    std::vector<maps::StoreStep> rest;
    for (auto& [robot, step] : steps_) rest.push_back(std::move(step));
    auto saved = map->apart.empty()
                     ? writer_->save_final(*map->map, map->frame_poses, frame, rest, map->robots)
                     : writer_->save_final(with_components(*map), frames_with_components(*map), frame, rest,
                                           map->robots);
    writer_.reset();
    return saved;
  }

 private:
  core::Result<void> take(core::Result<maps::StoreWriter> writer) {
    if (!writer) return tl::unexpected(writer.error());
    writer_.emplace(std::move(*writer));
    return {};
  }
  core::Result<void> add(maps::StoreStep step, const TrackedFrame& track,
                         std::vector<maps::StoreCloud> clouds) {
    if (track.changes == nullptr) {
      return core::usage_error(
          "store: only a map that was tracked can be stored; remove this stage where poses come from a file");
    }
    step.map = track.changes;
    step.robots = track.robots;
    step.clouds = std::move(clouds);
    return writer_->add(step);
  }

  /// All components as one map; each keeps its own frame, given by its tree.
  static maps::Map with_components(const MapResult& map) {
    std::vector<const maps::Map*> all{map.map.get()};
    for (const auto& component : map.apart) all.push_back(component->map.get());
    return maps::joined(all, std::vector<geometry::Rigid3>(all.size()));
  }
  static std::vector<maps::FramePose> frames_with_components(const MapResult& map) {
    std::vector<maps::FramePose> frames = map.frame_poses;
    for (const auto& component : map.apart) {
      std::size_t begin = 0;
      const std::int32_t robot = component->robots.front().number;
      while (begin < frames.size() && frames[begin].reference.robot != robot) ++begin;
      for (std::size_t i = 0; i < component->frame_poses.size(); ++i) {
        if (component->frame_poses[i].tracked) frames[begin + i] = component->frame_poses[i];
      }
    }
    return frames;
  }

  bool enabled_ = true;
  std::optional<maps::StoreWriter> writer_;
  std::map<std::int32_t, maps::StoreStep> steps_;  ///< since each robot's last keyframe
};

}  // namespace

StageType store_stage() {
  return stage_type<StoreStage>(
      "store", "Writes the maps to map.db during the run, one transaction per keyframe", Mode::kSerial,
      {{"track", track_port(), false},
       {"cloud", keyframe_cloud_port(), false},
       {"map", map_port()},
       {"result", cloud_port(), false}},
      {}, true);
}

}  // namespace plumbline::pipeline
