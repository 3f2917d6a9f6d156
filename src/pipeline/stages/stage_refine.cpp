// SPDX-License-Identifier: BSD-3-Clause
// refine: after the last frame, local maps are aligned with each other and the whole map is adjusted.
#include <map>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "plumbline/mapping/adjustment/refinement.hpp"
#include "plumbline/maps/camera_history.hpp"
#include "results/resumed_run.hpp"
#include "stages/stages.hpp"
#include "summary/sections.hpp"

namespace plumbline::pipeline {
namespace {

Json fits_section(const optimize::BundleFits& fits) {
  Json all = Json::object();
  for (const auto& [name, fit] :
       {std::pair{"points", fits.points}, std::pair{"lines", fits.lines}, std::pair{"edges", fits.edges}}) {
    if (fit.all > 0) all[name] = {{"all", fit.all}, {"fitting", fit.fitting}, {"rms", rounded(fit.rms)}};
  }
  return all;
}

class RefineStage : public Stage {
 public:
  void declare(core::OptionTable& table) override { options_.declare(table); }
  core::Result<void> start(const RunContext& context) override {
    executor_ = context.executor;
    log_ = context.log;
    for (const RobotInfo& robot : *context.input.robots) cameras_[robot.number] = robot.camera.color;
    return context.resumed != nullptr ? read_surfaces(*context.resumed) : core::Result<void>();
  }
  /// Only a coarse surface of each keyframe stays.
  core::Result<void> process(StageIo& io) override {
    if (!wants_surfaces()) return {};
    const auto keyframe = io.input<KeyframeCloud>("cloud");
    if (!keyframe->id.valid()) return {};
    auto surface = surface_of(*keyframe);
    if (!surface) return tl::unexpected(surface.error());
    const std::lock_guard<std::mutex> lock(one_at_a_time_);
    surfaces_[keyframe->id] = std::move(*surface);
    return {};
  }

  core::Result<void> finish(StageIo& io) override {
    const auto before = io.input<MapResult>("map");
    const std::shared_ptr<MapResult> result = refined(*before, summary_);
    for (auto& component : result->apart) {
      mapping::RefinementSummary own;
      component = refined(*component, own);
      summary_.refused += own.refused;
    }
    surfaces_.clear();
    result_ = result;
    io.output<MapResult>("map", result);
    return {};
  }

  void report(Json& summary) const override {
    std::vector<double> position, rotation;
    for (const mapping::KeyframeAccuracy& keyframe : result_->accuracy.keyframes) {
      position.push_back(keyframe.sigma_position_m());
      rotation.push_back(keyframe.sigma_rotation_rad());
    }

    // Stages before this one have counted the adjustments that they refused; the path has the sum of all.
    add(summary["path"]["refused_adjustments"], summary_.refused);

    summary["refine"] = {{"local_maps", summary_.local_maps},
                         {"tried", summary_.tried},
                         {"accepted", summary_.accepted},
                         {"rejected", summary_.rejected},
                         {"mean_rms", rounded(summary_.mean_rms)},
                         {"mean_shift_m", rounded(summary_.mean_shift_m)},
                         {"max_shift_m", rounded(summary_.max_shift_m)},
                         {"sigma_position_m", section_of(sigma_of(position))},
                         {"sigma_rotation_rad", section_of(sigma_of(rotation))},
                         {"sigma_note", result_->accuracy.missing},
                         {"before", fits_section(summary_.before)},
                         {"after", fits_section(summary_.after)}};
  }

 private:
  [[nodiscard]] std::shared_ptr<MapResult> refined(const MapResult& before,
                                                   mapping::RefinementSummary& summary) {
    auto result = std::make_shared<MapResult>(before);
    if (before.map == nullptr || before.map->keyframe_count() < 2)
      result->accuracy.missing = "the map has fewer than two keyframes";
    if (!options_.adjust) result->accuracy.missing = "refine.adjust is off";
    if (!result->accuracy.missing.empty()) return result;

    std::map<core::KeyframeId, mapping::CoarseSurface> surfaces = corrected_surfaces(before);
    auto map = std::make_shared<maps::Map>(*before.map);
    auto refined = mapping::refine_map(*map, surfaces, cameras_, options_, *executor_, *log_);
    result->map = map;
    take_poses_from_map(*result);
    result->accuracy = std::move(refined.accuracy);
    summary = refined.summary;
    return result;
  }
  [[nodiscard]] bool wants_surfaces() const { return options_.icp && options_.adjust; }
  /// Surface as received if it has our voxel size, else computed from the cloud.
  [[nodiscard]] core::Result<mapping::CoarseSurface> surface_of(const KeyframeCloud& keyframe) const {
    if (keyframe.surface != nullptr && keyframe.surface->voxel_m == options_.local_maps.voxel_m) {
      return keyframe.surface->samples;
    }
    const auto cloud = cloud_of(keyframe);
    if (!cloud) return tl::unexpected(cloud.error());
    return mapping::coarse_surface(**cloud, options_.local_maps.voxel_m);
  }
  /// The surfaces of a map's keyframes, as the latest version of their camera measured them.
  [[nodiscard]] std::map<core::KeyframeId, mapping::CoarseSurface> corrected_surfaces(const MapResult& map) {
    const maps::CameraHistory cameras(map.robots);
    const auto paths = maps::by_robot(map);
    std::map<core::KeyframeId, mapping::CoarseSurface> own;
    for (auto& [id, surface] : surfaces_) {
      if (!map.map->has_keyframe(id)) continue;
      const auto path = paths.find(id.robot);
      if (path != paths.end() && cameras.changes(id))
        cameras.apply(id, geometry::velocity_at(path->second, map.map->keyframe(id).stamp), surface);
      own[id] = std::move(surface);
    }
    return own;
  }
  /// Reads the surfaces of keyframes of the run that this one continues.
  core::Result<void> read_surfaces(const ResumedRun& run) {
    if (!wants_surfaces()) return {};
    const auto store = maps::StoreReader::open(run.store);
    if (!store) return tl::unexpected(store.error());
    const auto ids = store->cloud_ids();
    if (!ids) return tl::unexpected(ids.error());
    for (const core::KeyframeId id : *ids) {
      const auto cloud = store->cloud(id);
      if (!cloud) return tl::unexpected(cloud.error());
      surfaces_[id] = mapping::coarse_surface(**cloud, options_.local_maps.voxel_m);
    }
    return {};
  }

  const core::Executor* executor_ = nullptr;
  core::Log* log_ = nullptr;
  mapping::Cameras cameras_;
  mapping::RefinementOptions options_;
  std::mutex one_at_a_time_;
  std::map<core::KeyframeId, mapping::CoarseSurface> surfaces_;  ///< under the mutex while frames come
  mapping::RefinementSummary summary_;
  std::shared_ptr<const MapResult> result_;
};

}  // namespace

StageType refine_stage() {
  return stage_type<RefineStage>(
      "refine", "Aligns local maps with each other and adjusts the whole map once more", Mode::kStateless,
      {{"cloud", keyframe_cloud_port()}, {"map", map_port()}}, {{"map", map_port()}});
}

}  // namespace plumbline::pipeline
