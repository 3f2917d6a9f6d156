// SPDX-License-Identifier: BSD-3-Clause
// fuse: keyframe clouds at their final poses, merged into one voxel map.
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "chain_option.hpp"
#include "plumbline/cloud/voxel_map.hpp"
#include "plumbline/pipeline/summary.hpp"
#include "stages.hpp"

namespace plumbline::pipeline {
namespace {

/// Finite points only: holes of an organised cloud cost memory until the end of the run.
cloud::CloudPtr compact(const cloud::Cloud& cloud) {
  auto kept = std::make_shared<cloud::Cloud>();
  const auto finite = [](const cloud::Point& p) {
    return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
  };
  kept->points.reserve(static_cast<std::size_t>(std::count_if(cloud.begin(), cloud.end(), finite)));
  std::copy_if(cloud.begin(), cloud.end(), std::back_inserter(kept->points), finite);
  kept->width = static_cast<std::uint32_t>(kept->points.size());
  kept->height = 1;
  return kept;
}

class FuseStage : public Stage {
 public:
  void declare(core::OptionTable& table) override {
    options_.declare(table);
    table.integer("min_observations", min_observations_, {1, 1000}, "",
                  "Keyframes that must have seen a voxel for it to stay");
    filters_.declare(table, "Filter chain for the merged cloud; empty: none");
  }
  void check(const CheckContext& context, const core::ConfigMark& mark, const std::string& path,
             core::ConfigProblems& problems) override {
    filters_.check(context, mark, path, problems);
  }

  core::Result<void> start(const RunContext& context) override {
    log_ = context.log;
    return {};
  }
  core::Result<void> process(StageIo& io) override {
    const auto keyframe = io.input<KeyframeCloud>("cloud");
    clouds_.push_back({keyframe->id, compact(*keyframe->cloud)});
    return {};
  }

  /// Poses move until the last optimisation, so the clouds are laid down now, in the order of their
  /// keyframes.
  core::Result<void> finish(StageIo& io) override {
    const auto map = io.input<MapResult>("map");
    cloud::VoxelMap voxels(options_);
    for (const KeyframePose& keyframe : map->keyframes) {
      const auto found = std::find_if(clouds_.begin(), clouds_.end(),
                                      [&](const KeyframeCloud& c) { return c.id == keyframe.id; });
      if (found == clouds_.end()) continue;
      voxels.insert(*found->cloud, keyframe.world_from_camera);
      found->cloud.reset();
    }
    cloud::VoxelExtractOptions extract;
    extract.min_observations = min_observations_;
    std::vector<cloud::FilterReport> reports;
    auto filtered = filters_.chain().apply(voxels.extract(extract).cloud, {}, &reports);
    if (!filtered) return tl::unexpected<core::Error>(filtered.error());
    if (!reports.empty()) log_->debug("filters of the merged cloud:\n" + cloud::to_table(reports));
    auto dense = std::make_shared<DenseCloud>();
    dense->cloud = compact(**filtered);
    dense->voxel_m = options_.voxel_m;
    points_ = dense->cloud->size();
    io.output<DenseCloud>("cloud", dense);
    return {};
  }

  void summarise(RunSummary& summary) const override {
    summary.cloud_points = points_;
    summary.voxel_m = options_.voxel_m;
  }

 private:
  core::Log* log_ = nullptr;
  cloud::VoxelMapOptions options_;
  int min_observations_ = 1;
  ChainOption filters_{"filters/map.yaml"};
  std::vector<KeyframeCloud> clouds_;  ///< camera frame, until the end
  std::size_t points_ = 0;
};

}  // namespace

StageType fuse_stage() {
  return {"fuse",
          "Merges the keyframes' clouds at their final poses in a voxel map",
          Mode::kSerial,
          {{"cloud", keyframe_cloud_port()}, {"map", map_port()}},
          {{"cloud", cloud_port()}},
          [] { return std::make_unique<FuseStage>(); }};
}

}  // namespace plumbline::pipeline
