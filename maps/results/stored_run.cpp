// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/maps/stored_run.hpp"

#include <fmt/format.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <system_error>
#include <utility>

#include "plumbline/cloud/io/cloud_io.hpp"
#include "plumbline/cloud/transform.hpp"
#include "plumbline/core/config.hpp"
#include "plumbline/maps/components.hpp"
#include "plumbline/maps/fusion_state.hpp"
#include "plumbline/maps/map_join.hpp"
#include "plumbline/maps/output_folder.hpp"
#include "plumbline/maps/stored_views.hpp"

namespace plumbline::maps {
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

}  // namespace

core::Result<MapPlace> find_map(const fs::path& input) {
  if (input.empty()) return core::usage_error("the path of the map is empty");

  // The path may be the store itself
  std::error_code ec;
  MapPlace place;
  if (fs::is_regular_file(input, ec) && input.extension() == ".db") {
    place.store = input;
    return place;
  }

  // An interrupted run still has its partial folder
  if (!fs::exists(input, ec)) {
    const fs::path left = OutputFolder::partial_of(input) / kStoreFile;
    if (fs::is_regular_file(left, ec)) {
      place.store = left;
      return place;
    }
  }

  // A store suffices where the result is incomplete
  if (fs::is_regular_file(input / kStoreFile, ec)) place.store = input / kStoreFile;
  auto result = open_result(input);
  if (result) place.result = std::move(*result);
  if (!result && place.store.empty()) return tl::unexpected(result.error());
  return place;
}

StoredRun::StoredRun(fs::path file, StoreReader reader, StoredMap map)
    : file_(std::move(file)),
      reader_(std::make_unique<StoreReader>(std::move(reader))),
      map_(std::move(map)) {}

/// Opens the store and loads its map, `robot`'s if they are not merged.
core::Result<StoredRun> StoredRun::open(const fs::path& store, const std::string& robot) {
  auto reader = StoreReader::open(store);
  if (!reader) return tl::unexpected(reader.error());
  reader->read_ahead();
  auto map = reader->load(robot);
  if (!map) return tl::unexpected(map.error());
  return StoredRun(store, std::move(*reader), std::move(*map));
}

/// As open(), but only the component with most tracked frames.
core::Result<StoredRun> StoredRun::open_main(const fs::path& store, const std::string& robot) {
  auto run = open(store, robot);
  if (!run || roots(run->map_.map).size() < 2) return run;
  StoredMap& whole = run->map_;
  whole.map = component(whole.map, main_root(whole.map, whole.frames));
  whole.frames = frames_in(whole.map, std::move(whole.frames));
  return run;
}

/// New robot numbers in keyframes and frames; unchanged numbers cost nothing.
void StoredRun::renumber(const RobotNumbers& numbers) {
  numbers_ = numbers;
  const auto stays = [](const auto& number) { return number.first == number.second; };
  if (std::all_of(numbers.begin(), numbers.end(), stays)) return;
  map_.map = renumbered(map_.map, numbers);
  for (FramePose& frame : map_.frames) {
    const auto found = numbers.find(frame.reference.robot);
    if (frame.reference.valid() && found != numbers.end()) frame.reference.robot = found->second;
  }
}

void StoredRun::replace(Map map, std::vector<FramePose> frames) {
  map_.map = std::move(map);
  map_.frames = std::move(frames);
}

MapPoses StoredRun::poses() const {
  MapPoses poses = poses_of(map_.map, map_.frames);
  move(poses, map_.result.output_from_map);
  return poses;
}

/// Line landmarks in the output frame.
std::vector<LineSegment3> StoredRun::lines() const {
  std::vector<LineSegment3> segments = line_segments(map_.map);
  for (auto& [start, end] : segments) {
    start = map_.result.output_from_map * start;
    end = map_.result.output_from_map * end;
  }
  return segments;
}

cloud::DenseFusionOptions StoredRun::fusion_options() const {
  cloud::DenseFusionOptions options;
  core::OptionTable table;
  options.declare(table);

  // The fuse stage of the stored configuration
  const auto root = core::parse_yaml(map_.header.configuration, file_.string());
  const core::ConfigNode* stage = root ? fuse_stage_of(*root) : nullptr;
  if (stage == nullptr) return options;
  core::ConfigProblems ignored;  // of another version: unknown options keep their defaults
  for (const core::OptionSpec& spec : table.specs()) {
    if (const core::ConfigNode* value = stage->find(spec.key)) table.set(spec.key, *value, "fuse", ignored);
  }
  return options;
}

/// The point filters of the stored fuse stage; none if they cannot be parsed or write files.
cloud::FilterChain StoredRun::fusion_filters() const {
  const auto root = core::parse_yaml(map_.header.configuration, file_.string());
  const core::ConfigNode* stage = root ? fuse_stage_of(*root) : nullptr;
  const core::ConfigNode* list = stage != nullptr ? stage->find("filters") : nullptr;
  if (list == nullptr || list->kind != core::ConfigNode::Kind::kSequence) return {};
  core::ConfigProblems problems;
  const auto chain = cloud::FilterChain::parse_list(*list, "fuse", cloud::builtin_filters(), problems);
  return problems.empty() && chain.writes().empty() ? chain : cloud::FilterChain();
}

core::Result<StoredViews> StoredRun::views() const {
  return views_of(*reader_, poses_of(map_.map, map_.frames), map_.header.robots, {}, numbers_);
}

/// The pose covariances that the run stored, if any.
core::Result<FusionState> StoredRun::fusion_state() const {
  const auto kept = reader_->attachment(kFusionAttachment);
  if (!kept) return tl::unexpected(kept.error());
  if (!*kept) return FusionState{};
  auto state = fusion_state_of(**kept);
  if (!state) return core::input_error(fmt::format("{}: {}", file_.string(), state.error().message));
  return state;
}

core::Result<cloud::FusedCloud> StoredRun::fused(const cloud::DenseFusionOptions& options,
                                                 const core::Executor& executor) const {
  // Without views nothing can be fused
  const auto stored = views();
  if (!stored) return tl::unexpected(stored.error());
  if (stored->size() == 0) {
    return core::input_error(fmt::format("{}: holds no clouds; map the recording again", file_.string()));
  }
  const auto state = fusion_state();
  if (!state) return tl::unexpected(state.error());

  // Poses, cameras and covariances by view
  cloud::FusionViews all;
  all.world_from_camera = stored->world_from_camera;
  for (const std::int32_t robot : stored->robots) {
    all.cameras.push_back(camera_of(map_.header.robots, robot).color);
  }
  all.read = [&](std::size_t i) { return stored->read(i); };
  all.covariances = state->covariances_of(stored->robots, stored->stamps);

  // Filters work in the upright output frame
  auto fused = cloud::fuse_views(all, options, executor);
  if (!fused) return fused;
  if (map_.result.upright) cloud::transform(*fused->cloud, map_.result.output_from_map);
  return fusion_filters().apply(std::move(*fused), options.voxels.voxel_m, executor);
}

cloud::CloudFrame StoredRun::frame() const {
  return cloud::frame_with(map_.result.upright ? cloud::Up::kZ : cloud::Up::kMinusY);
}

core::Result<std::size_t> StoredRun::write_keyframe_clouds(const fs::path& folder) const {
  const auto stored = views();
  if (!stored) return tl::unexpected(stored.error());
  return maps::write_keyframe_clouds(folder, *stored, map_.result.output_from_map, frame(),
                                     [&](std::size_t i) { return stored->read(i); });
}

/// The run's cloud file, else its views fused again.
core::Result<cloud::CloudFile> read_map_cloud(const MapPlace& place, const core::Executor& executor) {
  // A written cloud needs no store
  std::error_code ec;
  const bool written =
      place.result && (fs::exists(place.result->ply(), ec) || fs::exists(place.result->pcd(), ec));
  if (written || place.store.empty()) return read_result_cloud(*place.result);

  // Fused with the options of the stored pipeline
  const auto stored = StoredRun::open_main(place);
  if (!stored) return tl::unexpected(stored.error());
  auto fused = stored->fused(stored->fusion_options(), executor);
  if (!fused) return tl::unexpected(fused.error());

  // The same properties as in a written file
  cloud::CloudFile file;
  file.cloud = std::move(fused->cloud);
  file.columns = std::move(fused->columns);
  file.frame = stored->frame();
  file.has_color = true;
  file.has_normals = true;
  return file;
}

}  // namespace plumbline::maps
