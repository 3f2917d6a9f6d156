// SPDX-License-Identifier: BSD-3-Clause
// refine: after the last frame, local maps are aligned with each other and the whole map is adjusted.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "plumbline/mapping/local_map_alignment.hpp"
#include "plumbline/pipeline/summary.hpp"
#include "stages/resumed_run.hpp"
#include "stages/stages.hpp"

namespace plumbline::pipeline {
namespace {

class RefineStage : public Stage {
 public:
  void declare(core::OptionTable& table) override {
    table.boolean("icp", icp_, "Align the surfaces of local maps that overlap, revisits included");
    table.boolean("adjust", adjust_, "Adjust all keyframes and landmarks together, with these alignments");
    local_maps_.declare(table);
    pairs_.declare(table);
    alignment_.declare(table);
    adjustment_.declare(table);
    table.boolean("accuracy", accuracy_, "Find out how exactly the keyframes are known: columns sigma");
  }
  core::Result<void> start(const RunContext& context) override {
    executor_ = context.executor;
    log_ = context.log;
    for (const RobotInfo& robot : *context.robots) cameras_[robot.number] = robot.camera.color;
    return context.resumed != nullptr ? read_surfaces(*context.resumed) : core::Result<void>();
  }
  /// Only a coarse surface of each keyframe stays.
  core::Result<void> process(StageIo& io) override {
    if (!icp_ || !adjust_) return {};
    const auto keyframe = io.input<KeyframeCloud>("cloud");
    if (!keyframe->id.valid()) return {};
    auto surface = surface_of(*keyframe);
    if (!surface) return tl::unexpected<core::Error>(surface.error());
    const std::lock_guard<std::mutex> lock(one_at_a_time_);
    surfaces_[keyframe->id] = std::move(*surface);
    return {};
  }

  core::Result<void> finish(StageIo& io) override {
    const auto before = io.input<MapResult>("map");
    auto result = std::make_shared<MapResult>(*before);
    if (adjust_ && before->map != nullptr && before->map->keyframe_count() > 1) {
      auto map = std::make_shared<maps::Map>(*before->map);
      auto accuracy = refine(*map);
      result->map = map;
      take_poses_from_map(*result);
      result->accuracy = std::move(accuracy);
    }
    clearing_ = executor_->submit([this] { surfaces_.clear(); });  // beside what comes next
    io.output<MapResult>("map", result);
    return {};
  }

  void summarise(RunSummary& summary) const override {
    summary.refine = counts_;
    summary.path.refused += refused_;
  }

 private:
  /// As it came, when it has our voxels.
  [[nodiscard]] core::Result<mapping::CoarseSurface> surface_of(const KeyframeCloud& keyframe) const {
    if (keyframe.surface != nullptr && keyframe.surface->voxel_m == local_maps_.voxel_m) {
      return keyframe.surface->samples;
    }
    const auto cloud = cloud_of(keyframe);
    if (!cloud) return tl::unexpected<core::Error>(cloud.error());
    return mapping::coarse_surface(**cloud, local_maps_.voxel_m);
  }
  /// Of the keyframes of the run that this one goes on from.
  core::Result<void> read_surfaces(const ResumedRun& run) {
    if (!icp_ || !adjust_) return {};
    const auto store = maps::StoreReader::open(run.store);
    if (!store) return tl::unexpected<core::Error>(store.error());
    const auto ids = store->cloud_ids();
    if (!ids) return tl::unexpected<core::Error>(ids.error());
    for (const core::KeyframeId id : *ids) {
      const auto cloud = store->cloud(id);
      if (!cloud) return tl::unexpected<core::Error>(cloud.error());
      surfaces_[id] = mapping::coarse_surface(**cloud, local_maps_.voxel_m);
    }
    return {};
  }
  /// How exactly the keyframes are known then, by id; empty: not known.
  std::vector<mapping::KeyframeAccuracy> refine(maps::Map& map) {
    std::vector<mapping::PoseEdge> edges;
    if (icp_) edges = align(map);
    const std::size_t alignments = edges.size();
    const std::vector<mapping::PoseEdge> loops = mapping::loop_edges(map);
    edges.insert(edges.end(), loops.begin(), loops.end());
    const mapping::GlobalAdjustmentSummary summary = mapping::adjust_map(map, cameras_, edges, adjustment_);
    for (std::size_t i = 0; i < std::min(alignments, summary.extra.size()); ++i) {
      counts_.rejected += summary.extra[i].rejected ? 1U : 0U;
    }
    counts_.mean_shift_m = summary.mean_shift_m;
    counts_.max_shift_m = summary.max_shift_m;
    counts_.before = summary.bundle.before;
    counts_.after = summary.bundle.after;
    refused_ = static_cast<std::size_t>(summary.refused);
    if (summary.refused > 0) log_->warning("refine: not put into the map: " + summary.refusal);
    if (!summary.changed) log_->warning("refine: the map stays as it is: " + summary.message);
    log_->debug(fmt::format(
        "refine: {} keyframes, {} points, {} lines, {} surface edges, {} alignments, {} loops; "
        "{} iterations; moved by {:.1f} mm on average, {:.1f} mm at most",
        summary.keyframes, summary.points, summary.lines, summary.surface_edges, alignments, loops.size(),
        summary.bundle.iterations, 1e3 * summary.mean_shift_m, 1e3 * summary.max_shift_m));
    if (!accuracy_) return {};
    std::vector<mapping::PoseEdge> believed;
    for (std::size_t i = 0; i < edges.size(); ++i) {
      if (summary.extra.empty() || !summary.extra[i].rejected) believed.push_back(edges[i]);
    }
    auto accuracy = mapping::keyframe_accuracy(map, cameras_, believed, adjustment_);
    note(accuracy);
    return accuracy;
  }
  void note(const std::vector<mapping::KeyframeAccuracy>& accuracy) {
    std::vector<double> position, rotation;
    for (const mapping::KeyframeAccuracy& keyframe : accuracy) {
      position.push_back(keyframe.sigma_position_m());
      rotation.push_back(keyframe.sigma_rotation_rad());
    }
    counts_.sigma_position_m = sigma_of(std::move(position));
    counts_.sigma_rotation_rad = sigma_of(std::move(rotation));
  }

  std::vector<mapping::PoseEdge> align(const maps::Map& map) {
    const auto local_maps = mapping::make_local_maps(map, surfaces_, local_maps_, *executor_);
    const auto pairs = mapping::overlapping_pairs(map, local_maps, pairs_, *executor_);
    const auto alignments = mapping::align_pairs(map, local_maps, pairs, alignment_, *executor_);
    auto edges = mapping::to_edges(local_maps, pairs, alignments);
    counts_.local_maps = local_maps.size();
    counts_.tried = pairs.size();
    counts_.accepted = edges.size();
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const mapping::SurfaceAlignment& a = alignments[i];
      if (a.refused.empty()) counts_.mean_rms += a.rms / static_cast<double>(edges.size());
      log_->debug(
          fmt::format("refine: local maps {} and {}: overlap {:.2f}, {} samples, rms {:.2f}, {} "
                      "directions held, moved by {:.1f} mm{}{}",
                      pairs[i].a, pairs[i].b, a.overlap, a.inliers, a.rms, a.held, 1e3 * a.shift_m,
                      a.refused.empty() ? "" : "; not used: ", a.refused));
    }
    return edges;
  }

  const core::Executor* executor_ = nullptr;
  core::Log* log_ = nullptr;
  mapping::Cameras cameras_;
  bool icp_ = true;
  bool adjust_ = true;
  bool accuracy_ = true;
  mapping::LocalMapOptions local_maps_;
  mapping::PairOptions pairs_;
  mapping::AlignmentOptions alignment_;
  mapping::GlobalAdjustmentOptions adjustment_;
  std::mutex one_at_a_time_;
  std::map<core::KeyframeId, mapping::CoarseSurface> surfaces_;  ///< under the mutex while frames come
  RunSummary::Refine counts_;
  std::size_t refused_ = 0;
  core::Executor::Job clearing_;  ///< goes first: it uses the others
};

}  // namespace

StageType refine_stage() {
  return {"refine",
          "Aligns local maps with each other and adjusts the whole map once more",
          Mode::kStateless,
          {{"cloud", keyframe_cloud_port()}, {"map", map_port()}},
          {{"map", map_port()}},
          [] { return std::make_unique<RefineStage>(); }};
}

}  // namespace plumbline::pipeline
