// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/pipeline/stored_result.hpp"

#include <fmt/format.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <mutex>
#include <system_error>
#include <utility>

#include "plumbline/cloud/cloud_io.hpp"
#include "plumbline/cloud/compact_cloud.hpp"
#include "plumbline/cloud/sensor_pose.hpp"
#include "plumbline/cloud/transform.hpp"
#include "plumbline/core/config.hpp"
#include "plumbline/pipeline/output_folder.hpp"
#include "plumbline/pipeline/stored_maps.hpp"
#include "run/fusion_state.hpp"
#include "run/resumed_run.hpp"
#include "stages/chain_option.hpp"

namespace plumbline::pipeline {
namespace {

namespace fs = std::filesystem;

/// The stage of type fuse in a configuration; null: none.
const core::ConfigNode* fuse_stage_of(const core::ConfigNode& root) {
  const core::ConfigNode* stages = root.find("stages");
  if (stages == nullptr) return nullptr;
  for (const auto& [name, stage] : stages->entries) {
    const core::ConfigNode* type = stage.find("type");
    if (type != nullptr && type->scalar == "fuse") return &stage;
  }
  return nullptr;
}

/// Views of a store: poses, and where their clouds are.
struct Views {
  std::vector<geometry::Rigid3> world_from_camera;
  std::vector<std::int32_t> robots;
  std::vector<core::KeyframeId> keyframes;  ///< invalid: a frame's
  std::vector<std::size_t> frames;
  std::vector<double> stamps;
};

core::Result<Views> views_of(const maps::StoreReader& reader, const maps::StoredMap& stored) {
  const auto ids = reader.cloud_ids();
  if (!ids) return tl::unexpected<core::Error>(ids.error());
  const auto frames = reader.frame_cloud_ids();
  if (!frames) return tl::unexpected<core::Error>(frames.error());
  Views views;
  for (const core::KeyframeId id : *ids) {
    if (!stored.map.has_keyframe(id)) continue;
    views.world_from_camera.push_back(stored.map.camera_from_world(id).inverse());
    views.robots.push_back(id.robot);
    views.keyframes.push_back(id);
    views.frames.push_back(0);
    views.stamps.push_back(stored.map.keyframe(id).stamp);
  }
  for (const std::size_t frame : *frames) {
    if (frame >= stored.frames.size() || !stored.frames[frame].tracked) continue;
    const maps::FramePose& pose = stored.frames[frame];
    views.world_from_camera.push_back(
        (pose.camera_from_reference * stored.map.camera_from_world(pose.reference)).inverse());
    views.robots.push_back(pose.reference.robot);
    views.keyframes.emplace_back();
    views.frames.push_back(frame);
    views.stamps.push_back(pose.stamp);
  }
  return views;
}

}  // namespace

core::Result<MapPlace> find_map(const fs::path& input) {
  std::error_code ec;
  MapPlace place;
  if (fs::is_regular_file(input, ec) && input.extension() == ".db") {
    place.store = input;
    return place;
  }
  if (!fs::exists(input, ec)) {
    const fs::path left = OutputFolder::partial_of(input) / kStoreFile;
    if (!input.empty() && fs::is_regular_file(left, ec)) {
      place.store = left;
      return place;
    }
  }
  if (fs::is_regular_file(input / kStoreFile, ec)) place.store = input / kStoreFile;
  auto result = open_result(input);
  if (result) place.result = std::move(*result);
  if (!result && place.store.empty()) return tl::unexpected<core::Error>(result.error());
  return place;
}

StoredResult::StoredResult(fs::path file, maps::StoreReader reader, maps::StoredMap map)
    : file_(std::move(file)),
      reader_(std::make_unique<maps::StoreReader>(std::move(reader))),
      map_(std::move(map)) {}

core::Result<StoredResult> StoredResult::open(const fs::path& store) {
  auto reader = maps::StoreReader::open(store);
  if (!reader) return tl::unexpected<core::Error>(reader.error());
  auto map = reader->load();
  if (!map) return tl::unexpected<core::Error>(map.error());
  return StoredResult(store, std::move(*reader), std::move(*map));
}

geometry::Trajectory StoredResult::trajectory() const {
  geometry::Trajectory poses = maps::trajectory(map_.frames, map_.map);
  for (geometry::StampedPose& pose : poses) {
    pose.world_from_camera = map_.result.output_from_map * pose.world_from_camera;
  }
  return poses;
}

std::vector<KeyframePose> StoredResult::keyframes() const {
  std::vector<KeyframePose> poses;
  for (const core::KeyframeId id : map_.map.keyframe_ids()) {
    poses.push_back({id, map_.map.keyframe(id).stamp,
                     map_.result.output_from_map * map_.map.camera_from_world(id).inverse()});
  }
  return poses;
}

geometry::Trajectory StoredResult::keyframe_trajectory() const {
  geometry::Trajectory poses;
  for (const KeyframePose& keyframe : keyframes()) {
    poses.push_back({keyframe.stamp, keyframe.world_from_camera});
  }
  return poses;
}

std::vector<maps::LineSegment3> StoredResult::lines() const {
  std::vector<maps::LineSegment3> segments = maps::line_segments(map_.map);
  for (auto& [start, end] : segments) {
    start = map_.result.output_from_map * start;
    end = map_.result.output_from_map * end;
  }
  return segments;
}

cloud::DenseFusionOptions StoredResult::fusion_options() const {
  cloud::DenseFusionOptions options;
  core::OptionTable table;
  options.declare(table);
  const auto root = core::parse_yaml(map_.header.configuration, file_.string());
  const core::ConfigNode* stage = root ? fuse_stage_of(*root) : nullptr;
  if (stage == nullptr) return options;
  core::ConfigProblems ignored;  // of another version: what it does not know keeps its default
  for (const core::OptionSpec& spec : table.specs()) {
    if (const core::ConfigNode* value = stage->find(spec.key)) table.set(spec.key, *value, "fuse", ignored);
  }
  return options;
}

cloud::FilterChain StoredResult::fusion_filters() const {
  const auto root = core::parse_yaml(map_.header.configuration, file_.string());
  const core::ConfigNode* stage = root ? fuse_stage_of(*root) : nullptr;
  const core::ConfigNode* list = stage != nullptr ? stage->find("filters") : nullptr;
  if (list == nullptr || list->kind != core::ConfigNode::Kind::kSequence) return {};
  core::ConfigProblems problems;
  const auto chain =
      cloud::FilterChain::parse(as_chain(*list, "fuse"), "fuse", cloud::builtin_filters(), problems);
  return problems.empty() && chain.writes().empty() ? chain : cloud::FilterChain();
}

core::Result<std::vector<sensor::Pinhole>> StoredResult::cameras_of(
    const std::vector<std::int32_t>& robots) const {
  std::vector<sensor::Pinhole> cameras(robots.size(), map_.header.camera.color);
  const auto list = reader_->attachment(kRobotsAttachment);
  if (!list) return tl::unexpected<core::Error>(list.error());
  if (!*list) return cameras;
  const auto known = robots_from_bytes(**list);
  if (!known) return core::input_error(fmt::format("{}: {}", file_.string(), known.error().message));
  for (std::size_t i = 0; i < robots.size(); ++i) {
    for (const RobotInfo& robot : *known) {
      if (robot.number == robots[i]) cameras[i] = robot.camera.color;
    }
  }
  return cameras;
}

core::Result<cloud::FusedCloud> StoredResult::fused(const cloud::DenseFusionOptions& options,
                                                    const core::Executor& executor) const {
  const auto views = views_of(*reader_, map_);
  if (!views) return tl::unexpected<core::Error>(views.error());
  if (views->keyframes.empty()) {
    return core::input_error(fmt::format("{}: holds no clouds; map the recording again", file_.string()));
  }
  const auto cameras = cameras_of(views->robots);
  if (!cameras) return tl::unexpected<core::Error>(cameras.error());
  FusionState state;
  const auto kept = reader_->attachment(kFusionAttachment);
  if (!kept) return tl::unexpected<core::Error>(kept.error());
  if (*kept) {
    auto read = fusion_state_of(**kept);
    if (!read) return core::input_error(fmt::format("{}: {}", file_.string(), read.error().message));
    state = std::move(*read);
  }
  std::mutex one_at_a_time;  // the reader is one connection
  const cloud::ReadView read = [&](std::size_t i) -> core::Result<cloud::CloudPtr> {
    const core::KeyframeId id = views->keyframes[i];
    auto bytes = [&] {
      const std::lock_guard<std::mutex> lock(one_at_a_time);
      return id.valid() ? reader_->cloud_bytes(id) : reader_->frame_cloud_bytes(views->frames[i]);
    }();
    if (!bytes) return tl::unexpected<core::Error>(bytes.error());
    auto cloud = cloud::decode_cloud(bytes->data(), bytes->size());
    if (cloud) {
      state.correct(views->robots[i], **cloud);
      return cloud;
    }
    return core::input_error(fmt::format("{}: {}", file_.string(), cloud.error().message));
  };
  cloud::FusionViews all;
  all.world_from_camera = views->world_from_camera;
  all.cameras = *cameras;
  all.read = read;
  all.covariances = state.covariances_of(views->robots, views->stamps);
  auto fused = cloud::fuse_views(all, options, executor);
  if (!fused) return fused;
  if (map_.result.upright) cloud::transform(*fused->cloud, map_.result.output_from_map);
  const cloud::FilterChain filters = fusion_filters();
  if (filters.size() == 0) return fused;
  cloud::FusedCloud result;
  cloud::FilterContext context;
  context.executor = &executor;
  context.spacing_m = options.voxels.voxel_m;
  context.columns = &fused->columns;
  context.made_columns = &result.columns;
  auto filtered = filters.apply(std::move(fused->cloud), context);
  if (!filtered) return tl::unexpected<core::Error>(filtered.error());
  result.cloud = std::move(*filtered);
  return result;
}

core::Result<std::size_t> StoredResult::write_keyframe_clouds(const fs::path& folder) const {
  std::error_code ec;
  fs::create_directories(folder, ec);
  if (ec) {
    return core::output_error(fmt::format("{}: cannot be created ({})", folder.string(), ec.message()));
  }
  const auto ids = reader_->cloud_ids();
  if (!ids) return tl::unexpected<core::Error>(ids.error());
  std::size_t written = 0;
  for (const core::KeyframeId id : *ids) {
    if (!map_.map.has_keyframe(id)) continue;
    const auto cloud = reader_->cloud(id);
    if (!cloud) return tl::unexpected<core::Error>(cloud.error());
    cloud::transform(**cloud, map_.result.output_from_map * map_.map.camera_from_world(id).inverse() *
                                  cloud::sensor_pose(**cloud));
    const std::string name =
        id.robot == 0 ? fmt::format("{:06}.ply", id.index) : fmt::format("{}_{:06}.ply", id.robot, id.index);
    if (auto done = cloud::write_ply(folder / name, **cloud); !done) {
      return tl::unexpected<core::Error>(done.error());
    }
    ++written;
  }
  return written;
}

core::Result<cloud::CloudFile> read_map_cloud(const MapPlace& place, const core::Executor& executor) {
  std::error_code ec;
  const bool written =
      place.result && (fs::exists(place.result->ply(), ec) || fs::exists(place.result->pcd(), ec));
  if (written || place.store.empty()) return read_result_cloud(*place.result);
  const auto stored = StoredResult::open(place.store);
  if (!stored) return tl::unexpected<core::Error>(stored.error());
  auto fused = stored->fused(stored->fusion_options(), executor);
  if (!fused) return tl::unexpected<core::Error>(fused.error());
  cloud::CloudFile file;
  file.cloud = std::move(fused->cloud);
  file.columns = std::move(fused->columns);
  file.has_color = true;
  file.has_normals = true;
  return file;
}

}  // namespace plumbline::pipeline
