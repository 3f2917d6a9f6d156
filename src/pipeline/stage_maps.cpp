// SPDX-License-Identifier: BSD-3-Clause
// maps: finished maps of several robots, laid into one frame; their clouds come one after another.
#include <algorithm>
#include <memory>
#include <optional>
#include <utility>

#include "plumbline/pipeline/stored_maps.hpp"
#include "plumbline/pipeline/summary.hpp"
#include "robot_merge.hpp"
#include "stages.hpp"

namespace plumbline::pipeline {
namespace {

class MapsStage : public Stage {
 public:
  void declare(core::OptionTable& table) override { options_.declare(table); }
  core::Result<void> start(const RunContext& context) override {
    context_ = &context;
    maps_ = context.stored_maps;
    if (maps_ == nullptr) {
      return core::usage_error("a pipeline that begins with finished maps is run by plumbline fuse");
    }
    anchor_ = maps_->parts().size();
    if (!context.anchor.empty()) {
      const auto found = maps_->find_part(context.anchor);
      if (!found) return tl::unexpected<core::Error>(found.error());
      anchor_ = *found;
    }
    for (const StoredPart& part : maps_->parts()) {
      parts_.push_back({part.name, {&part.map, part.cameras}, part.robots, &part.frames});
    }
    // One thread learns what places look like while others read surfaces.
    learning_ = context.executor->submit([this] { places_.emplace(learn_places(parts_, options_)); });
    return {};
  }
  [[nodiscard]] std::size_t frames() const override { return maps_->size(); }

  /// Surfaces are wanted at once; clouds wait where they are until they are laid down.
  core::Result<void> process(StageIo& io) override {
    const StoredCloud& stored = maps_->clouds()[io.frame()];
    auto result = std::make_shared<KeyframeCloud>();
    result->id = stored.id;
    result->stamp = stored.stamp;
    result->robot = stored.robot;
    result->stored = [maps = maps_, index = io.frame()] { return maps->cloud_bytes(index); };
    if (stored.id.valid()) {
      if (auto read = read_surface(io.frame(), *result); !read) {
        return tl::unexpected<core::Error>(maps_->damaged(stored.robot, read.error()));
      }
    }
    io.output<KeyframeCloud>("cloud", result);
    return {};
  }

  core::Result<void> finish(StageIo& io) override {
    learning_.wait();
    merged_ = merge_robots(parts_, *places_, anchor_, options_, *context_->executor, *context_->log);
    // Beside what comes next: it lies in many small pieces.
    forgetting_ = context_->executor->submit([this] { places_.reset(); });
    io.output<MapResult>("map", merged_.map);
    return {};
  }

  void summarise(RunSummary& summary) const override {
    const maps::Map& map = *merged_.map->map;
    summary.keyframes = map.keyframe_count();
    summary.points = map.point_count();
    summary.lines = merged_.map->lines.size();
    summary.merges = merged_.merges;
    summary.unconnected = merged_.unconnected;
    summary.path.refused += merged_.refused;
    for (const maps::FramePose& frame : merged_.map->frame_poses) {
      ++summary.frames.read;
      ++(frame.tracked ? summary.frames.tracked : summary.frames.lost);
    }
    summary.frames.available = summary.frames.read;
  }

 private:
  /// As it was kept with the map, if it was.
  core::Result<void> read_surface(std::size_t index, KeyframeCloud& result) const {
    const auto kept = maps_->surface_bytes(index);
    if (!kept) return tl::unexpected<core::Error>(kept.error());
    if (kept->empty()) return {};
    auto surface = maps::unpack_surface(*kept);
    if (!surface) return tl::unexpected<core::Error>(surface.error());
    result.surface = std::make_shared<maps::StoredSurface>(std::move(*surface));
    return {};
  }

  const RunContext* context_ = nullptr;
  const StoredMaps* maps_ = nullptr;
  mapping::MapFusionOptions options_;
  std::vector<RobotPart> parts_;
  std::size_t anchor_ = 0;
  std::optional<mapping::OverlapFinder> places_;
  MergedRobots merged_;
  core::Executor::Job forgetting_;
  core::Executor::Job learning_;  ///< goes first: it uses the others
};

}  // namespace

StageType maps_stage() {
  return {"maps",
          "Finds where finished maps of several robots overlap, lays them into one frame and adjusts them "
          "together",
          Mode::kStateless,
          {},
          {{"cloud", keyframe_cloud_port()}, {"map", map_port()}},
          [] { return std::make_unique<MapsStage>(); }};
}

}  // namespace plumbline::pipeline
