// SPDX-License-Identifier: BSD-3-Clause
#include "report_data.hpp"

#include <fmt/format.h>

#include <fstream>
#include <map>
#include <system_error>

#include "plumbline/core/config.hpp"
#include "plumbline/core/json.hpp"
#include "plumbline/dataset/trajectory_io.hpp"
#include "plumbline/maps/output_folder.hpp"
#include "plumbline/maps/result_folder.hpp"
#include "plumbline/maps/stored_maps.hpp"
#include "plumbline/maps/stored_run.hpp"
#include "plumbline/maps/unfinished_run.hpp"
#include "report_cloud.hpp"

namespace plumbline::report {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

core::Result<Json> read_summary(const fs::path& file) {
  auto json = core::read_json(file);

  // Missing or forbidden is not damaged.
  if (const std::string fault = fault_of(file); !json && fault != "is damaged")
    return core::input_error(fmt::format("{}: {}", file.string(), fault));
  if (!json) {
    return core::input_error(fmt::format("{}: is damaged or not of plumbline map ({}); map again",
                                         file.string(), json.error().message));
  }
  if (json->is_object() && json->contains("frames") && json->contains("trustworthy")) return json;
  return core::input_error(fmt::format("{}: is damaged or not of plumbline map; map again", file.string()));
}

/// The poses of a file, which is reported as missing where they cannot be had.
geometry::Trajectory poses_of(const fs::path& file, ReportData& data) {
  const std::string name = file.lexically_relative(data.folder).string();
  std::error_code ec;
  if (!fs::exists(file, ec)) {
    data.missing.push_back(name + " is not there");
    return {};
  }
  auto poses = dataset::read_trajectory(file);
  if (poses) return std::move(*poses);
  std::string why = poses.error().message;
  if (why.rfind(file.string(), 0) == 0) why = name + why.substr(file.string().size());
  data.missing.push_back(why);
  return {};
}

void add_paths(ReportData& data) {
  for (const fs::path& folder : maps::ResultFolder{data.folder}.robot_folders()) {
    ReportPath path;

    // The only robot's files are in the folder itself.
    if (folder != data.folder) path.robot = folder.filename().string();
    path.number = data.paths.size();
    path.poses = poses_of(folder / "trajectory.txt", data);
    path.keyframes = poses_of(folder / "keyframes.txt", data);
    data.paths.push_back(std::move(path));
  }
}

/// Pairs of keyframes that loops, and merges of several robots' maps, tie together.
void add_loops(const maps::StoredRun& stored, ReportData& data) {
  std::map<core::KeyframeId, Eigen::Vector3d> places;
  for (const maps::KeyframePose& k : stored.keyframes()) places[k.id] = k.world_from_camera.translation;
  for (const maps::LoopEdge& loop : stored.stored().map.loops()) {
    const auto a = places.find(loop.a);
    const auto b = places.find(loop.b);
    if (a != places.end() && b != places.end()) data.loops.emplace_back(a->second, b->second);
  }
}

/// Adds what only map.db knows: the number of each robot (in the ids of points, and of its colour), loops,
/// residuals.
void add_store(ReportData& data) {
  const fs::path file = data.folder / "map.db";
  std::error_code ec;
  if (!fs::exists(file, ec)) {
    // Without loops nothing is missing.
    const bool loops =
        number_at(data.summary, "/loops/accepted") > 0.0 || !list_at(data.summary, "/merges").empty();
    if (loops) data.missing.emplace_back("map.db is not there: loops are not drawn");
    return;
  }

  // A damaged map costs only its sections.
  const auto stored = maps::StoredRun::open_main(file);
  if (!stored) {
    data.missing.push_back(fmt::format("map.db {}: loops are not drawn", fault_of(file)));
    return;
  }

  // Cameras, names and numbers of the robots.
  std::map<std::int32_t, sensor::Pinhole> cameras;
  const std::vector<maps::RobotInfo>& robots = stored->stored().header.robots;
  for (const maps::RobotInfo& robot : robots) {
    cameras[robot.number] = robot.camera.color;
    if (robots.size() > 1) data.robot_names[robot.number] = robot.name;
    for (ReportPath& path : data.paths) {
      if (path.robot == robot.name && robot.number >= 0) path.number = static_cast<std::size_t>(robot.number);
    }
  }

  add_loops(*stored, data);
  data.fit = fit_of(stored->stored().map, maps::camera_of(robots, 0).color, cameras);
}

/// True if the folder is a result of plumbline fuse, which has no frames.
bool fused_afterwards(const fs::path& folder) {
  const auto config = core::read_yaml(folder / "config.yaml");
  const core::ConfigNode* run = config ? config->find("run") : nullptr;
  return run != nullptr && run->find("maps") != nullptr;
}

/// Nature of the result of a pipeline without a stage `output`, such as that of `robot`; "" for all others.
std::string kind_of(const ReportData& data) {
  const auto config = core::read_yaml(data.folder / "config.yaml");
  const core::ConfigNode* stages = config ? config->find("stages") : nullptr;
  if (stages == nullptr) return "";
  for (const auto& [name, stage] : stages->entries) {
    const core::ConfigNode* type = stage.find("type");
    if (type != nullptr && type->scalar == "output") return "";
  }
  return fmt::format(
      "pipeline {} has no stage output: all is in map.db, for fuse, export and render, and the report has "
      "neither paths nor a cloud",
      text_at(data.summary, "/pipeline"));
}

void add_cloud(ReportData& data) {
  std::error_code ec;
  const maps::ResultFolder result{data.folder};
  if (!fs::exists(result.ply(), ec) && !fs::exists(result.pcd(), ec)) {
    data.missing.emplace_back("map.ply is not there");
    return;
  }

  // PLY, else PCD.
  data.cloud_file = fs::exists(result.ply(), ec) ? "map.ply" : "map.pcd";
  auto cloud = maps::read_result_cloud(result);
  if (cloud) {
    data.cloud = std::move(*cloud);
    data.extent = measure_extent(*data.cloud->cloud);
  } else {
    const std::string fault = fault_of(data.folder / data.cloud_file);
    data.missing.push_back(fmt::format("{} {}: its extent and plan are not shown", data.cloud_file, fault));
  }
}

}  // namespace

/// Null where there is nothing.
static const Json& value_at(const Json& json, const std::string& place) {
  static const Json nothing;
  const Json::json_pointer pointer(place);
  return json.contains(pointer) ? json.at(pointer) : nothing;
}

double number_at(const Json& json, const std::string& place) {
  const Json& value = value_at(json, place);
  return value.is_number() ? value.get<double>() : kNaN;
}

bool flag_at(const Json& json, const std::string& place) { return value_at(json, place) == true; }

std::string text_at(const Json& json, const std::string& place) {
  const Json& value = value_at(json, place);
  return value.is_string() ? value.get<std::string>() : std::string();
}

const Json& list_at(const Json& json, const std::string& place) {
  static const Json nothing = Json::array();
  const Json& value = value_at(json, place);
  return value.is_structured() ? value : nothing;
}

double ReportPath::length_m() const {
  double length = 0.0;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    length += (poses[i].world_from_camera.translation - poses[i - 1].world_from_camera.translation).norm();
  }
  return length;
}

core::Result<ReportData> read_report_data(const fs::path& folder) {
  std::error_code ec;
  const fs::path partial = maps::OutputFolder::partial_of(folder);
  if (maps::is_running(folder) || (!fs::exists(folder, ec) && maps::is_running(partial)))
    return core::input_error(
        fmt::format("{}: the run is still going on; report when it has ended", folder.string()));

  // An interrupted run can be continued.
  const bool interrupted = fs::exists(folder / maps::kUnfinishedMarker, ec) ||
                           (!fs::exists(folder, ec) && fs::is_regular_file(partial / "map.db", ec));
  if (interrupted) {
    return core::input_error(fmt::format(
        "{}: the run was interrupted; finish it with plumbline map --resume, then report", folder.string()));
  }

  // Without a summary there is no report.
  const auto result = maps::open_result(folder);
  if (!result) return tl::unexpected<core::Error>(result.error());
  auto summary = read_summary(result->summary());
  if (!summary) return tl::unexpected<core::Error>(summary.error());

  // Name and axes of the result.
  ReportData data;
  data.folder = folder;
  const fs::path normal = fs::absolute(folder).lexically_normal();
  data.name = (normal.has_filename() ? normal : normal.parent_path()).filename().string();
  data.summary = std::move(*summary);
  data.z_up = text_at(data.summary, "/frame/up") != "none";

  // Paths before frames, which need them.
  add_paths(data);
  data.fused_afterwards = fused_afterwards(folder);
  add_frames(data);
  data.kind = kind_of(data);

  // A lone map.db lacks everything else.
  if (!data.kind.empty()) data.missing.clear();
  add_store(data);
  if (data.kind.empty()) add_cloud(data);
  return data;
}

}  // namespace plumbline::report
