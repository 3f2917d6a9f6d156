// SPDX-License-Identifier: BSD-3-Clause
// fuse: keyframe clouds at their final poses as one cloud. Until then they wait in a store.
#include <fmt/format.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "options/chain_option.hpp"
#include "plumbline/cloud/fusion/dense_fusion.hpp"
#include "plumbline/cloud/io/cloud_io.hpp"
#include "plumbline/cloud/transform.hpp"
#include "plumbline/maps/fusion_state.hpp"
#include "plumbline/maps/stored_maps.hpp"
#include "results/up_frame.hpp"
#include "results/waiting_clouds.hpp"
#include "robots/robot_bodies.hpp"
#include "stages/stages.hpp"
#include "summary/sections.hpp"
#include "visits/revised_clouds.hpp"

namespace plumbline::pipeline {
namespace {

void remove(const std::set<RevisedClouds::View>& left_out, maps::StoredViews& views) {
  // A copy keeps what all views have in common; only the lists with an entry for each view are filled again.
  maps::StoredViews kept = views;
  kept.keyframes.clear();
  kept.frames.clear();
  kept.world_from_camera.clear();
  kept.robots.clear();
  kept.stamps.clear();
  kept.velocities.clear();

  for (std::size_t i = 0; i < views.size(); ++i) {
    if (left_out.count({views.keyframes[i], views.frames[i]}) != 0) continue;
    kept.keyframes.push_back(views.keyframes[i]);
    kept.frames.push_back(views.frames[i]);
    kept.world_from_camera.push_back(views.world_from_camera[i]);
    kept.robots.push_back(views.robots[i]);
    kept.stamps.push_back(views.stamps[i]);
    kept.velocities.push_back(views.velocities[i]);
  }
  views = std::move(kept);
}

class FuseStage : public Stage {
 public:
  void declare(core::OptionTable& table) override {
    options_.declare(table);
    table.choice<Up>("up", up_, {{"floor", Up::kFloor}, {"camera", Up::kCamera}, {"none", Up::kNone}},
                     "Frame of all results: z up and 0 on the floor (within 45 degrees of the cameras' mean "
                     "up), z up as the first camera was held, or the frame of the poses");
    table.choice<Yaw>("yaw", yaw_, {{"walls", Yaw::kWalls}, {"camera", Yaw::kCamera}},
                      "Direction of x unless up is none: along the walls, the one nearest to where the first "
                      "camera looks, or exactly there");
    table.boolean("keyframe_clouds", keyframe_clouds_,
                  "Write the cloud of every keyframe to keyframes/, in the frame of the results");
    filters_.declare(table, "Filter chain for the merged cloud; empty: none");
  }
  void check(const CheckContext& context, const core::ConfigMark& /*mark*/, const std::string& path,
             core::ConfigProblems& problems) override {
    filters_.check(context, path, problems);
  }
  [[nodiscard]] std::vector<std::string> files() const override {
    std::vector<std::string> files = filters_.files();
    if (keyframe_clouds_) files.emplace_back("keyframes/*.ply");
    return files;
  }

  core::Result<void> start(const RunContext& context) override {
    context_ = &context;
    auto clouds = WaitingClouds::create(context);
    if (!clouds) return tl::unexpected(clouds.error());
    clouds_.emplace(std::move(*clouds));
    return {};
  }
  core::Result<void> process(StageIo& io) override {
    return clouds_->append(*io.input<KeyframeCloud>("cloud"));
  }

  /// Poses move until the last optimisation, so the clouds are fused now, in the order of their keyframes.
  core::Result<void> finish(StageIo& io) override {
    const auto map = io.input<MapResult>("map");
    const auto stored = clouds_->open();
    if (!stored) return tl::unexpected(stored.error());

    auto dense = lay_down(*map, **stored, report_);
    if (!dense) return tl::unexpected(dense.error());
    for (const auto& component : map->apart) {
      Report own;
      auto apart = lay_down(*component, **stored, own);
      if (!apart) return tl::unexpected(apart.error());
      (*dense)->apart.push_back(std::move(*apart));
    }

    clouds_->clear();
    io.output<DenseCloud>("cloud", std::move(*dense));
    return {};
  }

  [[nodiscard]] bool lays_clouds_down() const override { return true; }
  void report(Json& summary) const override {
    Json& cloud = summary["cloud"];
    cloud["points"] = report_.points;
    cloud["voxel_m"] = options_.voxels.voxel_m;
    report_left_out_of_map(report_.filters, cloud);
    cloud["sigma_m"] = section_of(report_.sigma);
    summary["frame"] = {{"up", report_.frame.up},
                        {"yaw", report_.frame.yaw},
                        {"output_from_map", rows(report_.frame.output_from_map)}};
    if (report_.frame.up == "floor") report_up(report_.frame.output_from_map, summary);
  }
  void doubt(const Json& summary, std::vector<Doubt>& reasons) const override {
    doubt_empty_cloud(summary, reasons);
  }

 private:
  /// Values for the summary.
  struct Report {
    std::vector<cloud::FilterReport> filters;  ///< of the merged cloud
    UpFrame frame;
    std::size_t points = 0;
    Sigma sigma;
  };

  /// The clouds of one connected map as one, filtered, in the frame of the output.
  core::Result<std::shared_ptr<DenseCloud>> lay_down(const MapResult& map, const maps::StoreReader& stored,
                                                     Report& report) {
    auto views = views_of(stored, map, map.robots, clouds_->arrivals());
    if (!views) return tl::unexpected(views.error());
    revised_ = map.revised;
    if (revised_ != nullptr) remove(revised_->left_out, *views);
    auto fused = fuse(map, *views);
    if (!fused) return tl::unexpected(fused.error());

    // The frame of the results comes before the filters: these may cut the floor away, and their boxes are
    // meant in that frame.
    auto dense = std::make_shared<DenseCloud>();
    dense->voxel_m = options_.voxels.voxel_m;
    report.frame = frame_of(map, fused->cloud);
    dense->output_from_map = report.frame.output_from_map;
    dense->upright = report.frame.up != "none";
    dense->state = state_;
    if (dense->upright) cloud::transform(*fused->cloud, report.frame.output_from_map);

    // Only the main map has no name; clouds of components apart have no known pose in its frame.
    if (keyframe_clouds_ && map.name.empty()) {
      const auto up = dense->upright ? cloud::Up::kZ : cloud::Up::kMinusY;
      const auto written = maps::write_keyframe_clouds(context_->output_folder / "keyframes", *views,
                                                       report.frame.output_from_map, cloud::frame_with(up),
                                                       [&](std::size_t i) { return read(*views, i); });
      if (!written) return tl::unexpected(written.error());
    }

    auto filtered =
        filters_.chain().apply(std::move(*fused), dense->voxel_m, *context_->executor, &report.filters);
    if (!filtered) return tl::unexpected(filtered.error());

    if (!report.filters.empty())
      context_->log->debug("filters of the merged cloud:\n" + cloud::to_table(report.filters));
    dense->cloud = std::move(filtered->cloud);
    dense->columns = std::move(filtered->columns);
    report.points = dense->cloud->size();

    for (const auto& column : dense->columns.others) {
      if (column.name == cloud::kSigmaColumn) report.sigma = sigma_of(column.values);
    }

    return dense;
  }

  [[nodiscard]] bool keeps_frame() const {
    const maps::StoredMaps* maps = context_->input.stored_maps;
    return context_->input.into || (maps != nullptr && maps->replaced());
  }
  /// A map that was visited again, or adjusted, keeps its frame.
  [[nodiscard]] UpFrame frame_of(const MapResult& map, const cloud::CloudConstPtr& cloud) const {
    if (!keeps_frame() || !map.name.empty()) return find_up(up_, yaw_, cloud, map.trajectory);
    const maps::ResultFrame& frame = context_->input.stored_maps->parts().front().run.stored().result;
    return {frame.output_from_map, frame.upright ? "map" : "none", frame.upright ? "map" : "none"};
  }

  core::Result<cloud::FusedCloud> fuse(const MapResult& map, const maps::StoredViews& stored) {
    cloud::FusionViews views;
    views.world_from_camera = stored.world_from_camera;
    views.cameras = cameras_of(stored);

    if (map.robots.size() > 1) {
      constexpr std::int32_t kMostRobots = 254;
      for (const std::int32_t robot : stored.robots)
        views.robots.push_back(static_cast<std::uint8_t>(std::clamp(robot, 0, kMostRobots)));
    }

    // The accuracy of a point follows from that of the keyframes that saw it. It is kept in the store, so
    // that a later fusion has it too.
    const std::vector<mapping::KeyframeAccuracy>& accuracy = map.accuracy.keyframes;
    for (std::size_t i = 0; i < accuracy.size(); ++i) {
      const maps::KeyframePose& keyframe = map.keyframes[i];
      state_->covariances[{keyframe.id.robot, keyframe.stamp}] = accuracy[i].covariance;
    }

    views.covariances = state_->covariances_of(stored.robots, stored.stamps);
    views.read = [&](std::size_t i) { return read(stored, i); };

    cloud::FusionReport report;
    auto fused = cloud::fuse_views(views, options_, *context_->executor, &report);
    context_->log->debug(fmt::format(
        "{} clouds, fused in {} tiles; {} points seen through, {} isolated; colour gains {:.2f} to {:.2f}",
        stored.size(), report.tiles, report.seen_through, report.isolated, report.least_gain,
        report.most_gain));
    return fused;
  }

  [[nodiscard]] std::vector<sensor::Pinhole> cameras_of(const maps::StoredViews& views) const {
    std::vector<sensor::Pinhole> cameras;
    for (const std::int32_t robot : views.robots) {
      cameras.push_back(maps::camera_of(*context_->input.robots, robot).color);
    }
    return cameras;
  }

  /// Reads a view. An error in a finished map names that map's own file.
  [[nodiscard]] core::Result<cloud::CloudPtr> read(const maps::StoredViews& views, std::size_t i) const {
    auto cloud = views.read(i);
    if (cloud && revised_ != nullptr) revised_->apply({views.keyframes[i], views.frames[i]}, **cloud);
    if (cloud || context_->input.stored_maps == nullptr) return cloud;
    return tl::unexpected(
        context_->input.stored_maps->damaged(views.keyframes[i], views.frames[i], cloud.error()));
  }

  const RunContext* context_ = nullptr;
  cloud::DenseFusionOptions options_;
  Up up_ = Up::kFloor;
  Yaw yaw_ = Yaw::kWalls;
  bool keyframe_clouds_ = false;
  ChainOption filters_{"filters/map.yaml"};
  std::optional<WaitingClouds> clouds_;
  std::shared_ptr<const RevisedClouds> revised_;  ///< of the map that is fused; null: all are as they were
  std::shared_ptr<maps::FusionState> state_ = std::make_shared<maps::FusionState>();
  Report report_;
};

}  // namespace

StageType fuse_stage() {
  return stage_type<FuseStage>(
      "fuse", "Merges the keyframes' clouds at their final poses into one cloud with thin walls",
      Mode::kSerial, {{"cloud", keyframe_cloud_port()}, {"map", map_port()}}, {{"cloud", cloud_port()}});
}

}  // namespace plumbline::pipeline
