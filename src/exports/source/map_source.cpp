// SPDX-License-Identifier: BSD-3-Clause
#include "source/map_source.hpp"

#include <fmt/format.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <system_error>

#include "plumbline/cloud/columns.hpp"
#include "plumbline/cloud/fusion/dense_fusion.hpp"
#include "plumbline/cloud/fusion/floor.hpp"
#include "plumbline/cloud/transform.hpp"
#include "plumbline/core/text.hpp"
#include "plumbline/dataset/trajectory_io.hpp"
#include "plumbline/maps/frame_pose.hpp"
#include "plumbline/maps/unfinished_run.hpp"

namespace plumbline::exports {
namespace {

namespace fs = std::filesystem;

/// True if the input is named like a cloud file. It need not exist, so that errors speak of a cloud.
bool is_cloud_file(const fs::path& input) {
  constexpr std::array<const char*, 7> kEndings = {".ply", ".pcd", ".xyz", ".txt", ".csv", ".asc", ".pts"};
  std::error_code ec;
  return !fs::is_directory(input, ec) &&
         std::any_of(kEndings.begin(), kEndings.end(),
                     [&](const char* ending) { return core::ending_of(input) == ending; });
}

Eigen::Vector3d position_of(const cloud::Point& point, const cloud::CloudFile& file) {
  return point.getVector3fMap().cast<double>() + file.shift;
}

bool is_component(const maps::MapPlace& place) {
  return place.result && place.result->folder.parent_path().filename() == "components";
}

/// A map that never joined the rest of its run: files in a folder of its own below components/.
std::optional<maps::MapPlace> find_component(const fs::path& input) {
  if (input.empty()) return std::nullopt;
  fs::path folder = fs::absolute(input).lexically_normal();
  if (!folder.has_filename()) folder = folder.parent_path();

  maps::MapPlace place;
  place.result = maps::ResultFolder{folder};
  std::error_code ec;
  if (!is_component(place) || !fs::is_regular_file(place.result->trajectory(), ec)) return std::nullopt;
  return place;
}

/// Why nothing is left to be written.
std::string cause_of_nothing(const ExportOptions& options) {
  const bool whole = options.box.empty() && options.z.empty() && options.storey < 0;
  if (options.voxel_m > 0.0) {
    return fmt::format("--voxel is {:g} m; choose a smaller one{}", options.voxel_m,
                       whole ? "" : ", or a larger --box, --z or --storey");
  }
  return whole ? "the map is empty" : "choose a larger --box, --z or --storey";
}

/// Points that `keep` selects, with their columns.
template <typename Keep>
cloud::CloudFile picked(const cloud::CloudFile& file, const Keep& keep) {
  std::vector<std::size_t> indices;
  for (std::size_t i = 0; i < file.cloud->size(); ++i) {
    const cloud::Point& p = (*file.cloud)[i];
    if (p.getVector3fMap().allFinite() && keep(position_of(p, file))) indices.push_back(i);
  }
  cloud::CloudFile result;
  result.cloud = std::make_shared<cloud::Cloud>();
  result.cloud->reserve(indices.size());
  for (const std::size_t i : indices) result.cloud->push_back((*file.cloud)[i]);
  result.columns = cloud::pick_columns(file.columns, indices);
  result.shift = file.shift;
  result.has_color = file.has_color;
  result.has_normals = file.has_normals;
  return result;
}

/// z along the floor's normal, x where the first camera looks, the origin on the floor below it.
geometry::Rigid3 upright_from_map(const cloud::Floor& floor, const geometry::Rigid3& first) {
  Eigen::Vector3d ahead = first.rotation.col(2) - first.rotation.col(2).dot(floor.normal) * floor.normal;
  if (ahead.norm() < 0.1) ahead = floor.normal.unitOrthogonal();
  Eigen::Matrix3d axes;
  axes.col(2) = floor.normal;
  axes.col(0) = ahead.normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  const Eigen::Vector3d origin =
      first.translation + (floor.height_m - floor.normal.dot(first.translation)) * floor.normal;
  return geometry::Rigid3(axes, origin).inverse();
}

}  // namespace

/// Heights of floors: peaks of the histogram of points that face up.
std::vector<double> floor_heights(const cloud::Cloud& cloud) {
  constexpr double kBin_m = 0.05;
  constexpr double kStorey_m = 2.0;    // floors are further apart
  constexpr double kLeastShare = 0.2;  // of the widest one's surface
  constexpr float kLevel = 0.94F;      // 20 degrees

  // Points of level surfaces by height
  std::map<long, std::size_t> bins;
  for (const cloud::Point& p : cloud) {
    if (p.getVector3fMap().allFinite() && p.normal_z > kLevel) ++bins[std::lround(p.z / kBin_m)];
  }

  std::size_t widest = 0;
  for (const auto& [bin, count] : bins) widest = std::max(widest, count);

  // Wide peaks, a storey apart
  std::vector<double> floors;
  for (auto bin = bins.begin(); bin != bins.end(); ++bin) {
    const auto next = std::next(bin);
    const bool peak = next == bins.end() || next->second < bin->second;
    const double height = static_cast<double>(bin->first) * kBin_m;
    const bool wide = static_cast<double>(bin->second) >= kLeastShare * static_cast<double>(widest);
    if (peak && wide && (floors.empty() || height > floors.back() + kStorey_m)) floors.push_back(height);
  }

  return floors;
}

/// Opens a map or a cloud, and checks the part of it that is selected.
core::Result<MapSource> MapSource::open(const ExportRequest& request, const core::Executor& executor,
                                        core::Log& log, const ExportProgress& progress) {
  MapSource source;
  source.request_ = &request;
  source.executor_ = &executor;
  source.log_ = &log;
  source.progress_ = &progress;
  source.cloud_only_ = is_cloud_file(request.input);
  const auto opened = source.cloud_only_ ? source.open_cloud() : source.open_map();
  if (!opened) return tl::unexpected(opened.error());
  if (!source.cloud_only_) source.name_frame();
  if (auto selected = source.select(); !selected) return tl::unexpected(selected.error());
  return source;
}

/// A cloud is read at once, because its file says what is up; if it does not, z is taken for it.
core::Result<void> MapSource::open_cloud() {
  const auto whole = whole_cloud();
  if (!whole) return tl::unexpected(whole.error());
  frame_ = maps::frame_of_cloud(request_->input, (*whole)->frame);
  upright_ = frame_.up() != cloud::Up::kMinusY;
  return {};
}

/// Opens a result, or a component of a run, with the store if it has one.
core::Result<void> MapSource::open_map() {
  auto place = maps::find_map(request_->input);
  if (place) {
    place_ = std::move(*place);
  } else if (auto component = find_component(request_->input)) {
    place_ = std::move(*component);
  } else {
    return tl::unexpected(place.error());
  }

  // Without a store only files of the result can be exported
  place_.robot = request_->robot;
  upright_ = place_.result.has_value();
  if (place_.store.empty()) return {};
  auto stored = maps::StoredRun::open_main(place_);
  if (!stored) return tl::unexpected(stored.error());
  store_.emplace(std::move(*stored));

  // A map of one robot lists that robot only
  const maps::StoredMap& map = store_->stored();
  world_from_map_ = map.result.output_from_map;
  upright_ = map.result.upright;
  for (const maps::RobotInfo& robot : map.header.robots) {
    if (map.robot < 0 || robot.number == map.robot) robots_.push_back(robot);
  }
  return map.complete ? core::Result<void>{} : level_interrupted();
}

/// A run that was interrupted has not found its floor, so it is searched now.
core::Result<void> MapSource::level_interrupted() {
  const auto frames = store_->trajectory();
  if (frames.empty()) {
    return core::input_error(
        fmt::format("{}: holds no frame yet; there is nothing to export", place_.store.string()));
  }

  // The floor is searched in the fused cloud
  auto fused = store_->fused(store_->fusion_options(), *executor_);
  if (!fused) return tl::unexpected(fused.error());

  cloud::CloudFile file;
  file.cloud = std::move(fused->cloud);
  file.columns = std::move(fused->columns);
  file.has_color = file.has_normals = true;

  // Cameras are held upright on average
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  for (const auto& pose : frames) up -= pose.world_from_camera.rotation.col(1);

  if (const auto floor = cloud::find_floor(file.cloud, up.normalized())) {
    world_from_map_ = upright_from_map(*floor, frames.front().world_from_camera);
    upright_ = true;
    cloud::transform(*file.cloud, world_from_map_);
  }

  // The cloud is kept for the export
  whole_ = std::move(file);
  log_->info(
      fmt::format("{}: the run {}; {}", place_.store.string(),
                  maps::is_running(place_.store.parent_path()) ? "is still going on" : "was interrupted",
                  upright_ ? "its floor was found now" : "no floor is seen: the frame of its first camera"));
  return {};
}

/// Sets the box of what is exported; a storey also sets the floor.
core::Result<void> MapSource::select() {
  constexpr double kAll = std::numeric_limits<double>::infinity();
  const ExportOptions& o = options();
  selected_ = Eigen::AlignedBox3d(Eigen::Vector3d::Constant(-kAll), Eigen::Vector3d::Constant(kAll));

  if (!o.box.empty()) {
    if (o.box.size() != 6 || o.box[0] >= o.box[3] || o.box[1] >= o.box[4] || o.box[2] >= o.box[5])
      return core::usage_error("--box: takes x0,y0,z0,x1,y1,z1, each first one below its second");
    selected_ = Eigen::AlignedBox3d(Eigen::Vector3d(o.box[0], o.box[1], o.box[2]),
                                    Eigen::Vector3d(o.box[3], o.box[4], o.box[5]));
  }

  // Heights of --z count from the map's zero
  if (!o.z.empty()) {
    if (o.z.size() != 2 || o.z[0] >= o.z[1])
      return core::usage_error("--z: takes two heights, the lower first");
    if (o.storey >= 0) return core::usage_error("--storey and --z both choose heights; give one of them");
    selected_.min().z() = std::max(selected_.min().z(), o.z[0]);
    selected_.max().z() = std::min(selected_.max().z(), o.z[1]);
    floor_m_ = 0.0;
  }

  // Storeys are found in an upright cloud
  if (o.storey < 0) return {};
  constexpr double kBelow_m = 0.2;  // points this far below belong to the storey's own floor
  if (auto up = need_upright("--storey"); !up) return up;

  const auto cloud = whole_cloud();
  if (!cloud) return tl::unexpected(cloud.error());

  // Floors from the lowest to the highest
  std::vector<double> floors = floor_heights(*(*cloud)->cloud);
  for (double& floor : floors) floor += (*cloud)->shift.z();
  const auto wanted = static_cast<std::size_t>(o.storey);
  if (wanted >= floors.size()) {
    return core::usage_error(fmt::format("--storey {}: {} floor{} seen; 0 is the lowest", o.storey,
                                         floors.size(), floors.size() == 1 ? " is" : "s are"));
  }

  // From one floor to the next
  floor_m_ = floors[wanted];
  if (wanted > 0) selected_.min().z() = std::max(selected_.min().z(), floors[wanted] - kBelow_m);
  if (wanted + 1 < floors.size())
    selected_.max().z() = std::min(selected_.max().z(), floors[wanted + 1] - kBelow_m);
  return {};
}

std::string MapSource::name() const {
  const fs::path& input = request_->input;
  std::string name = (input.has_filename() ? input : input.parent_path()).filename().string();
  if (name == maps::kStoreFile) name = fs::absolute(input).parent_path().filename().string();
  if (name.empty() || name == ".") name = fs::absolute(input).parent_path().filename().string();
  return core::printable(name);
}

/// The store, or an error that says why there is none.
core::Result<const maps::StoredRun*> MapSource::store(const std::string& what) const {
  if (store_) return &*store_;
  if (is_component(place_)) {
    return core::input_error(
        fmt::format("{}: {} did not join the map of its run, and only that map has {}; this one "
                    "gives clouds, meshes, plans, paths, lines and pages",
                    request_->output.string(), request_->input.string(), what));
  }
  if (cloud_only_) {
    return core::input_error(fmt::format("{}: {} is a cloud, and only a map has {}; name its result folder",
                                         request_->output.string(), request_->input.string(), what));
  }
  return core::input_error(
      fmt::format("{}: {} has no map.db, which holds {}; map the recording again with a pipeline that tracks "
                  "(known_poses keeps none) and without store.enabled=off",
                  request_->output.string(), request_->input.string(), what));
}

core::Result<void> MapSource::need_upright(const std::string& what) const {
  if (upright_) return {};
  return core::input_error(
      fmt::format("{}: the {} is not upright, so that heights over the floor are not known; {}", what,
                  cloud_only_ ? "cloud" : "map",
                  cloud_only_ ? "turn it with the filter transform" : "map again without fuse.up=none"));
}

void MapSource::name_frame() {
  frame_.text = upright_ ? "the map's; metres, right-handed, z up, z = 0 on the floor"
                         : "the map's; metres, right-handed, that of its first camera (z ahead, y down)";
}

std::string MapSource::frame_text() const {
  return frame_.known() ? frame_.comments().front() : "frame: the cloud's; its file does not say what is up";
}

/// The whole cloud, fused again if another voxel size is wanted.
core::Result<cloud::CloudFile> MapSource::read_cloud() const {
  const double voxel_m = options().voxel_m;
  if (cloud_only_ || (voxel_m > 0.0 && !store_)) {
    auto file = cloud_only_ ? cloud::read_cloud(request_->input, cloud::LargeCoordinates::kShifted)
                            : maps::read_map_cloud(place_, *executor_);
    if (!file || voxel_m == 0.0) return file;
    cloud::FusedCloud coarse = cloud::coarser(*file->cloud, file->columns, voxel_m);
    file->cloud = std::move(coarse.cloud);
    file->columns = std::move(coarse.columns);
    return file;
  }

  // Another voxel size: fused again from the stored views
  if (voxel_m == 0.0) return maps::read_map_cloud(place_, *executor_);
  cloud::DenseFusionOptions fusion = store_->fusion_options();
  fusion.voxels.voxel_m = voxel_m;
  auto fused = store_->fused(fusion, *executor_);
  if (!fused) return tl::unexpected(fused.error());

  // Fused clouds always have colours and normals
  cloud::CloudFile file;
  file.cloud = std::move(fused->cloud);
  file.columns = std::move(fused->columns);
  file.has_color = file.has_normals = true;
  return file;
}

/// The whole cloud, read again only if the voxel size has changed.
core::Result<const cloud::CloudFile*> MapSource::whole_cloud() {
  if (!whole_ || whole_voxel_m_ != options().voxel_m) {
    auto file = read_cloud();
    if (!file) return tl::unexpected(file.error());
    if (store_ && !store_->stored().complete && upright_) cloud::transform(*file->cloud, world_from_map_);
    whole_ = std::move(*file);
    whole_voxel_m_ = options().voxel_m;
  }
  return &*whole_;
}

/// The selected points; the whole cloud is released afterwards.
core::Result<const cloud::CloudFile*> MapSource::cloud() {
  if (chosen_) return &*chosen_;
  const auto whole = whole_cloud();
  if (!whole) return tl::unexpected(whole.error());
  chosen_ = picked(**whole, [&](const Eigen::Vector3d& p) { return selected_.contains(p); });
  whole_.reset();
  if (chosen_->cloud->empty()) {
    return core::input_error(fmt::format("{}: no point of the cloud is left to be written; {}",
                                         request_->input.string(), cause_of_nothing(options())));
  }
  return &*chosen_;
}

/// Poses of the store, with the keyframe of each frame that is one.
core::Result<std::vector<ExportPose>> MapSource::stored_poses(bool keyframes_only) const {
  const maps::StoredMap& map = store_->stored();
  const maps::MapPoses poses = maps::poses_of(map.map, map.frames);
  const bool several = robots_.size() > 1;

  // A single robot needs no name
  const auto name_of = [&](std::int32_t number) -> std::string {
    for (const maps::RobotInfo& robot : robots_) {
      if (several && robot.number == number) return robot.name;
    }
    return "";
  };

  // Keyframes by robot and stamp
  std::map<std::pair<std::int32_t, double>, core::KeyframeId> keyframes;
  std::vector<ExportPose> all;
  for (const maps::KeyframePose& keyframe : poses.keyframes) {
    keyframes[{keyframe.id.robot, keyframe.stamp}] = keyframe.id;
    if (keyframes_only) {
      all.push_back({keyframe.id.robot, name_of(keyframe.id.robot), keyframe.id, keyframe.stamp,
                     world_from_map_ * keyframe.world_from_camera});
    }
  }

  // A frame with a keyframe's stamp is that keyframe
  for (std::size_t i = 0; !keyframes_only && i < poses.trajectory.size(); ++i) {
    const geometry::StampedPose& pose = poses.trajectory[i];
    const std::int32_t robot = poses.trajectory_ids[i].robot;
    const auto keyframe = keyframes.find({robot, pose.stamp});
    all.push_back({robot, name_of(robot), keyframe == keyframes.end() ? core::KeyframeId{} : keyframe->second,
                   pose.stamp, world_from_map_ * pose.world_from_camera});
  }

  return all;
}

/// Poses from the text files of a result without a store.
core::Result<std::vector<ExportPose>> MapSource::written_poses(bool keyframes_only) const {
  std::vector<ExportPose> all;
  const auto folders = place_.result->robot_folders();
  for (std::size_t robot = 0; robot < folders.size(); ++robot) {
    const std::string name =
        folders[robot] != place_.result->folder ? folders[robot].filename().string() : "";
    const auto poses =
        dataset::read_trajectory(folders[robot] / (keyframes_only ? "keyframes.txt" : "trajectory.txt"));
    if (!poses) return tl::unexpected(poses.error());
    for (const auto& pose : *poses)
      all.push_back({static_cast<std::int32_t>(robot), name, {}, pose.stamp, pose.world_from_camera});
  }
  return all;
}

/// Selected poses, sorted by robot and stamp.
core::Result<std::vector<ExportPose>> MapSource::poses(bool keyframes_only) const {
  if (cloud_only_) {
    return core::usage_error(
        fmt::format("{}: is a cloud, which has no path of a camera; name a map", request_->input.string()));
  }
  auto all = store_ ? stored_poses(keyframes_only) : written_poses(keyframes_only);
  if (!all) return all;
  all->erase(std::remove_if(all->begin(), all->end(),
                            [&](const ExportPose& p) { return !selects(p.world_from_camera.translation); }),
             all->end());
  if (all->empty()) {
    return core::input_error(fmt::format("{}: no pose of the camera is left to be written; {}",
                                         request_->input.string(), cause_of_nothing(options())));
  }
  std::stable_sort(all->begin(), all->end(), [](const ExportPose& a, const ExportPose& b) {
    return a.robot != b.robot ? a.robot < b.robot : a.stamp < b.stamp;
  });
  return all;
}

}  // namespace plumbline::exports
