// SPDX-License-Identifier: BSD-3-Clause
// plumbline info MAP|CLOUD|DATASET
#include <fmt/format.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <system_error>
#include <vector>

#include "app.hpp"
#include "plumbline/cloud/io/cloud_io.hpp"
#include "plumbline/core/json.hpp"
#include "plumbline/dataset/bag.hpp"
#include "plumbline/dataset/live.hpp"
#include "plumbline/dataset/recording_poses.hpp"
#include "plumbline/dataset/summary.hpp"
#include "plumbline/dataset/trajectory_io.hpp"
#include "plumbline/diagnose/signs.hpp"
#include "plumbline/maps/stored_run.hpp"
#include "plumbline/net/ros2.hpp"
#include "plumbline/pipeline/input.hpp"
#include "plumbline/pipeline/verdict.hpp"
#include "plumbline/synth/source.hpp"
#include "result_page.hpp"
#include "terminal/print.hpp"
#include "terminal/signals.hpp"

namespace plumbline::cli {
namespace {

struct InfoRequest {
  std::string input;
  dataset::OpenOptions open;
  bool json = false;
};

core::Result<void> describe_store(const std::filesystem::path& file) {
  // Header and counts, without the map
  const auto reader = maps::StoreReader::open(file);
  if (!reader) return tl::unexpected<core::Error>(reader.error());
  const auto contents = reader->contents();
  if (!contents) return tl::unexpected<core::Error>(contents.error());

  // Robots and size on disk
  const maps::StoreHeader& header = reader->header();
  std::string robots;
  for (const maps::RobotInfo& robot : header.robots) robots += (robots.empty() ? "" : ", ") + robot.name;
  std::error_code ec;
  const double file_mb = static_cast<double>(std::filesystem::file_size(file, ec)) / 1e6;

  // One key and value per line
  print("store: {}\nstore.format: {}\nstore.program: plumbline {}\nstore.robot: {}\n", file.string(),
        header.format, header.program_version, robots);
  print("store.complete: {}\n",
        contents->complete ? "yes" : "no; map --resume continues it, export and render read it");
  print("store.keyframes: {}\nstore.points: {}\nstore.lines: {}\n", contents->keyframes, contents->points,
        contents->lines);

  // Constraints and clouds
  print("store.surface_edges: {}\nstore.loops: {}\nstore.frames: {}\n", contents->edges, contents->loops,
        contents->frames);
  print("store.clouds: {} of keyframes, {} of frames between\n", contents->keyframe_clouds,
        contents->frame_clouds);

  // Attachments and sizes
  for (const std::string& name : contents->attachments) print("store.attachment: {}\n", name);
  print("store.size_mb: {:.1f}\nstore.clouds_mb: {:.1f}\n", file_mb,
        static_cast<double>(contents->cloud_bytes) / 1e6);
  return {};
}

/// The summary as text or as JSON.
core::Result<void> describe_result(const std::filesystem::path& folder, bool json) {
  const std::filesystem::path file = folder / "summary.json";
  const auto summary = core::read_json(file);
  if (!summary) return core::input_error(summary.error().message + "; map again");
  if (!summary->is_object())
    return core::input_error(fmt::format("{}: holds no object of JSON; map again", file.string()));
  if (const std::string sentence = pipeline::sentence_of(*summary); !json && !sentence.empty())
    print("{}\n", sentence);
  print("{}", json ? core::json_text(*summary) : result_page(*summary));
  return {};
}

core::Result<void> describe_cloud(const std::filesystem::path& file) {
  // Floats hold large coordinates only less a shift
  const auto read = cloud::read_cloud(file, cloud::LargeCoordinates::kShifted);
  if (!read) return tl::unexpected<core::Error>(read.error());

  // Bounds of the finite points
  Eigen::Array3f low = Eigen::Array3f::Constant(INFINITY);
  Eigen::Array3f high = Eigen::Array3f::Constant(-INFINITY);
  for (const cloud::Point& p : *read->cloud) {
    const Eigen::Array3f position(p.x, p.y, p.z);
    if (!position.isFinite().all()) continue;
    low = low.min(position);
    high = high.max(position);
  }

  // An empty cloud has no bounds
  if (read->cloud->empty()) {
    print("points: 0\nnote: the cloud is empty\n");
    return {};
  }

  // Properties of the file
  print("points: {}\nwithout position: {}\n", read->cloud->size(), read->nan_points);
  if (read->cloud->isOrganized()) print("organised: {} x {}\n", read->cloud->width, read->cloud->height);
  print("colour: {}\nnormals: {}\n", read->has_color ? "yes" : "no", read->has_normals ? "yes" : "no");
  if (read->has_normals) print("without normal: {}\n", read->nan_normals);
  if (!read->shift.isZero(0.0)) print("shift: {}\n", shift_text(read->shift));

  // Bounds in the file's coordinates
  if ((low <= high).all()) {
    const Eigen::Array3d from = low.cast<double>() + read->shift.array();
    const Eigen::Array3d to = high.cast<double>() + read->shift.array();
    print("from: {:.3f} {:.3f} {:.3f} m\nto: {:.3f} {:.3f} {:.3f} m\n", from.x(), from.y(), from.z(), to.x(),
          to.y(), to.z());
    const Eigen::Array3f size = high - low;
    print("size: {:.3f} x {:.3f} x {:.3f} m\n", size.x(), size.y(), size.z());
  }
  return {};
}

/// Summary and store, as far as they exist.
core::Result<void> describe_map(const maps::MapPlace& place, bool json) {
  if (json && !place.result)
    return core::usage_error(fmt::format("--json: {} has no summary.json yet", place.store.string()));
  if (place.result) {
    if (auto described = describe_result(place.result->folder, json); !described || json) return described;
  }
  return place.store.empty() ? core::Result<void>() : describe_store(place.store);
}

/// True if the file is a trajectory; clouds of points are text files too.
bool is_trajectory(const std::filesystem::path& file) {
  return (file.extension() == ".txt" || file.extension() == ".csv") && dataset::holds_poses(file);
}

/// Length, times and format of a path.
void describe_path(const dataset::TrajectoryReading& reading) {
  const geometry::Trajectory& path = reading.poses;
  double length_m = 0.0;
  for (std::size_t i = 1; i < path.size(); ++i) {
    length_m += (path[i].world_from_camera.translation - path[i - 1].world_from_camera.translation).norm();
  }
  print("poses: {}\n", path.size());
  if (reading.stamped) print("from: {:.6f} s\nto: {:.6f} s\n", path.front().stamp, path.back().stamp);
  print("length: {:.3f} m\nformat: {}\n", length_m, reading.format);
  for (const std::string& note : reading.notes) print("note: {}\n", note);
}

/// Mistakes that show in a few frames, without a path.
void describe_signs(const dataset::FrameSource& source) {
  diagnose::Samples samples(source.camera().color, source.size());
  for (const std::size_t i : samples.wanted()) {
    if (const auto frame = source.read(i)) samples.add(*frame);
  }
  std::vector<diagnose::Sign> signs = diagnose::signs_of(samples);
  if (const auto truth = source.truth()) signs.push_back(diagnose::pose_sign(samples, *truth));
  for (const diagnose::Sign& sign : signs) {
    if (sign.certainty == diagnose::Certainty::kNone) continue;
    print("sign: {}{}\n", sign.certainty == diagnose::Certainty::kLikely ? "perhaps " : "",
          diagnose::sentence(sign));
  }
}

/// Layout, camera and signs of a wrong calibration.
core::Result<void> describe_recording(Session& session, InfoRequest& request) {
  const auto pipelines = session.pipelines_folder();
  if (!pipelines) return tl::unexpected<core::Error>(pipelines.error());
  request.open.cameras_folder = *pipelines / "cameras";
  const auto source = pipeline::open_input(request.input, request.open, *pipelines / "scenes",
                                           session.executor(), session.console());
  if (!source) return tl::unexpected<core::Error>(source.error());
  print("{}", dataset::to_text(**source));
  describe_signs(**source);
  return {};
}

/// Describes a bag, its topics first: they are listed even if no recording can be made of them.
core::Result<void> describe_bag(Session& session, InfoRequest& request) {
  const auto topics = dataset::bag_to_text(request.input, request.open.topics);
  if (!topics) return tl::unexpected<core::Error>(topics.error());
  print("{}", *topics);
  return describe_recording(session, request);
}

/// Topics and rates of a live camera.
core::Result<void> describe_live(InfoRequest& request) {
  const auto stream = net::open_live_stream(request.input, request.open.topics);
  if (!stream) return tl::unexpected<core::Error>(stream.error());
  request.open.live.stop = stop_on_signals();
  const auto text = dataset::live_to_text(request.input, **stream, request.open);
  if (!text) return tl::unexpected<core::Error>(text.error());
  print("{}", *text);
  return {};
}

core::Result<void> info(Session& session, InfoRequest& request) {
  // --format json means the same as --json
  if (request.open.format == "json") {
    request.json = true;
    request.open.format = "auto";
  }

  // Addresses need no file
  std::error_code ec;
  const std::filesystem::path path = request.input;
  const auto map = maps::find_map(path);  // also of a run that was interrupted and has left no `path`
  if (request.json && !map)
    return core::usage_error(
        "--json: is for results of plumbline map and fuse, whose summary.json it prints");
  if (dataset::is_live_address(request.input)) return describe_live(request);
  if (synth::is_synth_url(request.input)) return describe_recording(session, request);

  // A path is a map, or something else
  if (map) return describe_map(*map, request.json);
  if (!std::filesystem::exists(path, ec)) {
    return core::input_error(fmt::format("{}: no such map, cloud or recording", request.input));
  }

  // Bags, paths, clouds and recordings
  if (dataset::is_bag(path)) return describe_bag(session, request);
  if (!std::filesystem::is_directory(path, ec) && !dataset::is_recording_file(path)) {
    if (!is_trajectory(path)) return describe_cloud(path);
    const auto poses = dataset::read_trajectory_file(path);
    if (!poses) return tl::unexpected<core::Error>(poses.error());
    describe_path(*poses);
    return {};
  }
  return describe_recording(session, request);
}

}  // namespace

void add_info(CLI::App& app, Session& session) {
  // The input
  const auto request = std::make_shared<InfoRequest>();
  CLI::App* command = add_command(app, session, "info", "Describe a recording, a map or a cloud",
                                  [&session, request] { return info(session, *request); });
  command
      ->add_option(
          "INPUT", request->input,
          "A recording, a ROS bag, ros2://DOMAIN, a result folder, map.db, a cloud file or synth:SCENE")
      ->required();

  // The layout and the camera of a recording.
  command->add_option("--camera", request->open.camera, "Shipped calibration or file")
      ->type_name("NAME|FILE");
  add_topic_option(*command, request->open);
  auto formats = dataset::layout_names();

  // json is accepted, although it is not a layout
  formats.emplace_back("json");
  command
      ->add_option("--format", request->open.format,
                   "Layout of the recording (default: auto); json: as --json")
      ->check(CLI::IsMember(formats));
  command->add_flag("--json", request->json, "Print all that a result's summary.json says, as JSON");
}

}  // namespace plumbline::cli
