// SPDX-License-Identifier: BSD-3-Clause
// maps: finished maps of robots; their clouds come one after another.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "plumbline/maps/components.hpp"
#include "plumbline/maps/stored_maps.hpp"
#include "robots/camera_refinement.hpp"
#include "robots/robot_components.hpp"
#include "stages/stages.hpp"
#include "summary/sections.hpp"

namespace plumbline::pipeline {
namespace {

/// Warns of maps of one kind of camera of which one was brought to another scale.
void warn_of_scales(const std::vector<RobotInfo>& robots, core::Log& log) {
  constexpr double kOther = 0.001;   // difference that counts
  constexpr double kLargest = 0.15;  // more is another unit
  for (std::size_t i = 0; i < robots.size(); ++i) {
    for (std::size_t j = i + 1; j < robots.size(); ++j) {
      const sensor::Camera& a = robots[i].camera;
      const sensor::Camera& b = robots[j].camera;
      const bool alike = a.color.width == b.color.width && std::abs(a.color.fx / b.color.fx - 1.0) < 0.02;
      const double differs = std::abs(a.depth_scale / b.depth_scale - 1.0);
      if (!alike || differs < kOther || differs > kLargest) continue;
      log.warning(
          fmt::format("{} and {} are of different scale: their cameras' depth_scale differs by {:.2f} %; "
                      "adjust both, or map the other with the adjusted camera.yaml",
                      robots[i].name, robots[j].name, 100.0 * differs));
    }
  }
}

class MapsStage : public Stage {
 public:
  core::Result<void> start(const RunContext& context) override {
    log_ = context.log;
    maps_ = context.input.stored_maps;
    into_ = context.input.into || (maps_ != nullptr && maps_->replaced());
    if (maps_ == nullptr) {
      return core::usage_error("a pipeline that begins with finished maps is run by plumbline fuse");
    }
    warn_of_scales(maps_->robots(), *log_);
    return {};
  }
  [[nodiscard]] std::size_t frames() const override { return maps_->clouds().size(); }
  [[nodiscard]] bool reads_maps() const override { return true; }

  /// Surfaces are needed at once; clouds stay in the store until they are fused.
  core::Result<void> process(StageIo& io) override {
    const maps::StoredCloud& stored = maps_->clouds()[io.frame()];
    const maps::StoredViews& views = maps_->views_of(stored);
    auto result = std::make_shared<KeyframeCloud>();
    result->id = views.keyframes[stored.view];
    result->frame = views.frames[stored.view];
    result->stamp = views.stamps[stored.view];
    result->stored = [&views, view = stored.view] { return views.bytes(view); };

    auto surface = views.surface(stored.view);
    if (!surface) return tl::unexpected(maps_->damaged(result->id, {}, surface.error()));
    if (*surface) result->surface = std::make_shared<maps::StoredSurface>(std::move(**surface));
    io.output<KeyframeCloud>("cloud", result);
    return {};
  }

  core::Result<void> finish(StageIo& io) override {
    auto result = std::make_shared<RobotMaps>();
    for (const maps::StoredPart& part : maps_->parts()) {
      const maps::StoredMap& stored = part.run.stored();
      const RobotMap whole{part.name, part.robots, std::make_shared<maps::Map>(stored.map), stored.frames};

      const std::size_t first = result->maps.size();

      for (RobotMap& component : components_of(whole).maps) result->maps.push_back(std::move(component));
      if (!into_) continue;

      // The map that is visited begins with its main component; a visit is a component of it, joined or not.
      if (first > 0) {
        for (std::size_t m = first; m < result->maps.size(); ++m) result->maps[m].component = true;
        continue;
      }
      const core::KeyframeId root = maps::main_root(stored.map, stored.frames);
      std::stable_partition(result->maps.begin(), result->maps.end(),
                            [&](const RobotMap& map) { return map.map->has_keyframe(root); });
    }

    io.output<RobotMaps>("maps", result);
    for (const Json& pair : camera_pairs(maps_->robots())) log_->info(pair.at("text").get<std::string>());
    return {};
  }

  /// The cameras as the runs found them that made the maps.
  void report(Json& summary) const override {
    for (const RobotInfo& robot : maps_->robots()) {
      if (robot.estimate) summary["camera"].push_back(camera_section(robot));
    }
    summary["camera_pairs"] = camera_pairs(maps_->robots());
  }

 private:
  core::Log* log_ = nullptr;
  const maps::StoredMaps* maps_ = nullptr;
  bool into_ = false;
};

}  // namespace

StageType maps_stage() {
  return stage_type<MapsStage>("maps", "Reads finished maps of robots, with their stored clouds",
                               Mode::kStateless, {},
                               {{"cloud", keyframe_cloud_port()}, {"maps", maps_port()}});
}

}  // namespace plumbline::pipeline
