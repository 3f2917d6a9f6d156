// SPDX-License-Identifier: BSD-3-Clause
// fuse: keyframe clouds at their final poses as one cloud. Until then they wait on disk.
#include <fmt/format.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "plumbline/cloud/cloud_io.hpp"
#include "plumbline/cloud/dense_fusion.hpp"
#include "plumbline/cloud/depth_field.hpp"
#include "plumbline/cloud/sensor_pose.hpp"
#include "plumbline/cloud/transform.hpp"
#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/pipeline/robot_recordings.hpp"
#include "plumbline/pipeline/stored_maps.hpp"
#include "plumbline/pipeline/summary.hpp"
#include "run/fusion_state.hpp"
#include "run/resumed_run.hpp"
#include "stages/chain_option.hpp"
#include "stages/stages.hpp"
#include "stages/up_frame.hpp"
#include "stages/waiting_clouds.hpp"

namespace plumbline::pipeline {
namespace {

class FuseStage : public Stage {
 public:
  void declare(core::OptionTable& table) override {
    options_.declare(table);
    table.choice<Up>("up", up_, {{"floor", Up::kFloor}, {"camera", Up::kCamera}, {"none", Up::kNone}},
                     "Frame of all results: z up and 0 on the floor (within 45 degrees of the cameras' own "
                     "up on average), z up "
                     "as the first camera was held, or the frame of the poses as they are");
    table.choice<Yaw>(
        "yaw", yaw_, {{"walls", Yaw::kWalls}, {"camera", Yaw::kCamera}},
        "Where x points unless up is none: along the walls, as near as can be to where the first "
        "camera looks, or just there");
    table.boolean("depth_field", find_depth_field_,
                  "Find out from overlapping views what the depth camera gets wrong everywhere alike, and "
                  "correct it");
    depth_field_.declare(table);
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
    if (!clouds) return tl::unexpected<core::Error>(clouds.error());
    clouds_.emplace(std::move(*clouds));
    return context.resumed != nullptr ? read_clouds(*context.resumed) : core::Result<void>();
  }
  core::Result<void> process(StageIo& io) override {
    const auto keyframe = io.input<KeyframeCloud>("cloud");
    if (keyframe->id.valid()) {
      places_[keyframe->id] = clouds_->size();
    } else {
      intermediate_.push_back({keyframe->robot, keyframe->stamp, clouds_->size()});
    }
    return clouds_->append(keyframe->compact.get(), io.frame());
  }

  /// Poses move until the last optimisation, so the clouds are laid down now, in the order of their
  /// keyframes.
  core::Result<void> finish(StageIo& io) override {
    const auto map = io.input<MapResult>("map");
    auto fused = fuse(*map);
    if (!fused) return tl::unexpected<core::Error>(fused.error());
    auto dense = std::make_shared<DenseCloud>();
    dense->voxel_m = options_.voxels.voxel_m;
    frame_ = find_up(up_, yaw_, fused->cloud, map->trajectory);
    dense->output_from_map = frame_.output_from_map;
    dense->upright = frame_.up != "none";
    dense->state = state_;
    if (dense->upright) cloud::transform(*fused->cloud, frame_.output_from_map);
    if (keyframe_clouds_) {
      if (auto written = write_keyframes(*map); !written) return written;
    }
    clouds_.reset();
    if (auto done = filter(std::move(*fused), *dense); !done) return done;
    points_ = dense->cloud->size();
    for (const auto& column : dense->columns.others) {
      if (column.name == cloud::kSigmaColumn) sigma_ = sigma_of(column.values);
    }
    io.output<DenseCloud>("cloud", dense);
    return {};
  }

  void summarise(RunSummary& summary) const override {
    add_left_out(reports_, summary);
    summary.cloud_points = points_;
    summary.voxel_m = options_.voxels.voxel_m;
    summary.cloud_sigma_m = sigma_;
    summary.up = frame_.up;
    summary.yaw = frame_.yaw;
    summary.output_from_map = frame_.output_from_map;
    summary.depth_fields = reported_fields_;
  }

 private:
  /// Those of the run that this one goes on from.
  core::Result<void> read_clouds(const ResumedRun& run) {
    const auto fail = [](const core::Error& error) { return tl::unexpected<core::Error>(error); };
    const auto store = maps::StoreReader::open(run.store);
    if (!store) return fail(store.error());
    const auto keyframes = store->cloud_ids();
    if (!keyframes) return fail(keyframes.error());
    for (const core::KeyframeId id : *keyframes) {
      const auto bytes = store->cloud_bytes(id);
      if (!bytes) return fail(bytes.error());
      places_[id] = clouds_->size();
      if (auto kept = clouds_->append(&*bytes, 0); !kept) return kept;
    }
    const auto frames = store->frame_cloud_ids();
    if (!frames) return fail(frames.error());
    for (const std::size_t frame : *frames) {
      const auto bytes = store->frame_cloud_bytes(frame);
      if (!bytes) return fail(bytes.error());
      if (frame >= run.map.frames.size()) continue;
      const maps::FramePose& pose = run.map.frames[frame];
      intermediate_.push_back({pose.reference.robot, pose.stamp, clouds_->size()});
      if (auto kept = clouds_->append(&*bytes, 0); !kept) return kept;
    }
    return {};
  }

  [[nodiscard]] sensor::Pinhole camera_of(std::int32_t robot) const {
    return context_->stored_maps != nullptr ? context_->stored_maps->camera_of(robot)
                                            : context_->recordings->robot(robot).camera.color;
  }

  /// A cloud of a keyframe or frame that was tracked.
  struct View {
    std::size_t place;  ///< among the clouds
    std::int32_t robot;
    double stamp;
    geometry::Rigid3 world_from_camera;
  };

  /// Keyframes in the map's order, then frames between them.
  [[nodiscard]] std::vector<View> views_at(const MapResult& map) const {
    std::vector<View> views;
    for (const KeyframePose& keyframe : map.keyframes) {
      const auto found = places_.find(keyframe.id);
      if (found == places_.end()) continue;
      views.push_back({found->second, keyframe.id.robot, keyframe.stamp, keyframe.world_from_camera});
    }
    std::map<std::int32_t, geometry::Trajectory> trajectories;
    for (const IntermediateFrame& between : intermediate_) {
      const auto known = trajectories.find(between.robot);
      const geometry::Trajectory& poses =
          known != trajectories.end()
              ? known->second
              : trajectories.emplace(between.robot, trajectory_of(map, between.robot)).first->second;
      const auto found =
          std::lower_bound(poses.begin(), poses.end(), between.stamp,
                           [](const geometry::StampedPose& p, double s) { return p.stamp < s; });
      if (found == poses.end() || found->stamp != between.stamp) continue;  // a frame that was lost
      views.push_back({between.place, between.robot, between.stamp, found->world_from_camera});
    }
    return views;
  }

  core::Result<cloud::FusedCloud> fuse(const MapResult& map) {
    const std::vector<View> views = views_at(map);
    if (find_depth_field_) {
      if (auto found = find_fields(map, views); !found) return tl::unexpected<core::Error>(found.error());
    }
    read_covariances(map);
    cloud::FusionViews laid;
    std::vector<std::int32_t> robots;
    std::vector<double> stamps;
    for (const View& view : views) {
      constexpr std::int32_t kMostRobots = 254;
      laid.world_from_camera.push_back(view.world_from_camera);
      laid.cameras.push_back(camera_of(view.robot));
      if (map.robots.size() > 1)
        laid.robots.push_back(static_cast<std::uint8_t>(std::clamp(view.robot, 0, kMostRobots)));
      robots.push_back(view.robot);
      stamps.push_back(view.stamp);
    }
    laid.covariances = state_->covariances_of(robots, stamps);
    laid.read = [&](std::size_t i) { return read_corrected(views[i].place, views[i].robot); };
    cloud::FusionReport report;
    auto fused = cloud::fuse_views(laid, options_, *context_->executor, &report);
    context_->log->debug(fmt::format(
        "{} clouds{}, fused in {} tiles; {} points seen through, {} isolated; colour gains {:.2f} "
        "to {:.2f}",
        views.size(),
        clouds_->bytes() > 0 ? fmt::format(", {:.1f} MB", static_cast<double>(clouds_->bytes()) / 1e6)
                             : std::string(),
        report.tiles, report.seen_through, report.isolated, report.least_gain, report.most_gain));
    return fused;
  }

  /// Of all keyframes or none.
  void read_covariances(const MapResult& map) {
    for (const KeyframePose& keyframe : map.keyframes) {
      if (!keyframe.accuracy) return state_->covariances.clear();
      state_->covariances[{keyframe.id.robot, keyframe.stamp}] = keyframe.accuracy->covariance;
    }
  }

  /// One depth field for each robot's camera, from its views in order of time.
  core::Result<void> find_fields(const MapResult& map, const std::vector<View>& views) {
    std::vector<geometry::Rigid3> poses;
    std::map<std::int32_t, std::vector<std::size_t>> by_robot;
    for (const View& view : views) {
      by_robot[view.robot].push_back(poses.size());
      poses.push_back(view.world_from_camera);
    }
    const cloud::ReadView read = [&](std::size_t i) { return clouds_->read(views[i].place); };
    for (auto& [robot, own] : by_robot) {
      std::stable_sort(own.begin(), own.end(),
                       [&](std::size_t a, std::size_t b) { return views[a].stamp < views[b].stamp; });
      cloud::DepthFieldReport report;
      const auto field = cloud::find_depth_field(own, poses, read, camera_of(robot), depth_field_,
                                                 *context_->executor, &report);
      if (!field) return tl::unexpected<core::Error>(field.error());
      state_->depth_fields[robot] = *field;
      const auto info = std::find_if(map.robots.begin(), map.robots.end(),
                                     [number = robot](const RobotInfo& r) { return r.number == number; });
      const std::string name = info != map.robots.end() ? info->name : std::string();
      reported_fields_.push_back({name, report, *field});
      context_->log->debug(fmt::format(
          "depth field{}{}: {} samples, disagreement {:.3f} sigma, {:.3f} without what the field "
          "explains: {}",
          name.empty() ? "" : " of ", name, report.samples, report.before, report.after,
          report.used ? fmt::format("up to {:.0f} mm at 2 m", 1e3 * report.most_at_2m) : "not used"));
    }
    return {};
  }

  [[nodiscard]] core::Result<cloud::CloudPtr> read_corrected(std::size_t place, std::int32_t robot) const {
    auto cloud = clouds_->read(place);
    if (cloud) state_->correct(robot, **cloud);
    return cloud;
  }

  /// The largest thing in memory is not copied when there is nothing to filter.
  core::Result<void> filter(cloud::FusedCloud fused, DenseCloud& dense) {
    if (filters_.chain().size() == 0) {
      dense.cloud = std::move(fused.cloud);
      dense.columns = std::move(fused.columns);
      return {};
    }
    cloud::FilterContext context;
    context.executor = context_->executor;
    context.spacing_m = options_.voxels.voxel_m;
    context.columns = &fused.columns;
    context.made_columns = &dense.columns;
    auto filtered = filters_.chain().apply(std::move(fused.cloud), context, &reports_);
    if (!filtered) return tl::unexpected<core::Error>(filtered.error());
    context_->log->debug("filters of the merged cloud:\n" + cloud::to_table(reports_));
    dense.cloud = std::move(*filtered);
    return {};
  }

  core::Result<void> write_keyframes(const MapResult& map) const {
    const std::filesystem::path folder = context_->output_folder / "keyframes";
    std::error_code ec;
    std::filesystem::create_directories(folder, ec);
    if (ec)
      return core::output_error(fmt::format("{}: cannot be created ({})", folder.string(), ec.message()));
    for (const KeyframePose& keyframe : map.keyframes) {
      const auto found = places_.find(keyframe.id);
      if (found == places_.end()) continue;
      const auto cloud = read_corrected(found->second, keyframe.id.robot);
      if (!cloud) return tl::unexpected<core::Error>(cloud.error());
      cloud::transform(**cloud,
                       frame_.output_from_map * keyframe.world_from_camera * cloud::sensor_pose(**cloud));
      const std::string name = keyframe.id.robot == 0
                                   ? fmt::format("{:06}.ply", keyframe.id.index)
                                   : fmt::format("{}_{:06}.ply", keyframe.id.robot, keyframe.id.index);
      if (auto written = cloud::write_ply(folder / name, **cloud); !written) return written;
    }
    return {};
  }

  const RunContext* context_ = nullptr;
  cloud::DenseFusionOptions options_;
  Up up_ = Up::kFloor;
  Yaw yaw_ = Yaw::kWalls;
  bool find_depth_field_ = true;
  cloud::DepthFieldOptions depth_field_;
  bool keyframe_clouds_ = false;
  ChainOption filters_{"filters/map.yaml"};
  std::optional<WaitingClouds> clouds_;             ///< camera frame
  std::map<core::KeyframeId, std::size_t> places_;  ///< among the clouds
  /// A cloud of a frame intermediate keyframes.
  struct IntermediateFrame {
    std::int32_t robot = 0;
    double stamp = 0.0;
    std::size_t place = 0;  ///< among the clouds
  };
  std::vector<IntermediateFrame> intermediate_;
  std::shared_ptr<FusionState> state_ = std::make_shared<FusionState>();
  std::vector<RunSummary::DepthField> reported_fields_;
  std::vector<cloud::FilterReport> reports_;  ///< of the merged cloud's filters
  UpFrame frame_;
  std::size_t points_ = 0;
  Sigma sigma_;
};

}  // namespace

StageType fuse_stage() {
  return {"fuse",
          "Merges the keyframes' clouds at their final poses into one cloud with thin walls",
          Mode::kSerial,
          {{"cloud", keyframe_cloud_port()}, {"map", map_port()}},
          {{"cloud", cloud_port()}},
          [] { return std::make_unique<FuseStage>(); }};
}

}  // namespace plumbline::pipeline
