// SPDX-License-Identifier: BSD-3-Clause
// plumbline render MAP|CLOUD -o FILE.png
#include <fmt/format.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <set>
#include <system_error>

#include "app.hpp"
#include "option_flags.hpp"
#include "paths.hpp"
#include "plumbline/cloud/fusion/dense_fusion.hpp"
#include "plumbline/cloud/io/cloud_io.hpp"
#include "plumbline/cloud/io/ply.hpp"
#include "plumbline/core/own_files.hpp"
#include "plumbline/dataset/trajectory_io.hpp"
#include "plumbline/maps/output_check.hpp"
#include "plumbline/maps/output_folder.hpp"
#include "plumbline/maps/result_folder.hpp"
#include "plumbline/maps/stored_run.hpp"
#include "plumbline/viz/snapshot.hpp"
#include "plumbline/viz/turntable.hpp"
#include "video.hpp"

namespace plumbline::cli {
namespace {

namespace fs = std::filesystem;

struct RenderRequest {
  fs::path input;
  fs::path output;
  std::string robot;
  std::string size;
  bool lines = false;
  int turntable = 0;  ///< pictures all round; 0: one picture
  viz::SnapshotOptions options;
  OptionFlags flags;
};

/// "1600x1200"
core::Result<void> parse_size(const std::string& text, viz::SnapshotOptions& options) {
  constexpr int kLeast = 64;
  constexpr int kMost = 8192;
  int width = 0;
  int height = 0;
  int used = 0;
  if (std::sscanf(text.c_str(), "%9dx%9d%n", &width, &height, &used) != 2 ||
      static_cast<std::size_t>(used) != text.size()) {
    return core::usage_error(fmt::format("--size: '{}' is not a size; write it as 1600x1200", text));
  }
  if (std::min(width, height) < kLeast || std::max(width, height) > kMost) {
    return core::usage_error(
        fmt::format("--size: '{}': width and height are {} to {} pixels", text, kLeast, kMost));
  }
  options.width_px = width;
  options.height_px = height;
  return {};
}

/// The map that `input` names, directly or by its map.ply or map.pcd; none: a single cloud.
core::Result<std::optional<maps::MapPlace>> map_of(const fs::path& input, const std::string& robot) {
  std::error_code ec;
  const std::string name = input.filename().string();
  if (fs::is_regular_file(input, ec) && input.extension() != ".db") {
    const fs::path folder = fs::absolute(input).parent_path();
    if ((name != "map.ply" && name != "map.pcd") || !maps::is_result_folder(folder)) return std::nullopt;
    return maps::MapPlace{maps::ResultFolder{folder}, {}};
  }
  auto place = maps::find_map(input);
  if (!place) return tl::unexpected<core::Error>(place.error());
  place->robot = robot;
  return std::move(*place);
}

core::Result<void> add_paths(const maps::MapPlace& place, bool lines, viz::Scene& scene) {
  // Paths of all robots
  std::vector<maps::LineSegment3> segments;
  for (const fs::path& folder : place.result ? place.result->robot_folders() : std::vector<fs::path>{}) {
    auto trajectory = dataset::read_trajectory(folder / "trajectory.txt");
    if (!trajectory) return tl::unexpected<core::Error>(trajectory.error());
    scene.paths.emplace_back().trajectory = std::move(*trajectory);
  }

  // Lines from the result's file
  std::error_code ec;
  const bool has_lines = place.result && (fs::exists(place.result->lines(), ec) || place.store.empty());
  if (lines && has_lines) {
    auto read = maps::read_lines_ply(place.result->lines());
    if (!read) return tl::unexpected<core::Error>(read.error());
    segments = std::move(*read);
  }

  // Else from the store
  if (!place.result || (lines && !has_lines)) {
    const auto stored = maps::StoredRun::open_main(place);
    if (!stored) return tl::unexpected<core::Error>(stored.error());
    if (!place.result) scene.paths.emplace_back().trajectory = stored->trajectory();
    if (lines) segments = stored->lines();
  }

  // Lines are drawn as segments
  for (const auto& [a, b] : segments) scene.segments.push_back({a, b});
  return {};
}

/// Adds one value per point, for the colour mode.
core::Result<void> add_scalars(const cloud::CloudFile& file, const fs::path& input, viz::ColorMode mode,
                               viz::Scene& scene) {
  // The mode needs a column of the cloud
  const auto missing = [&](const char* what, const char* why = "") {
    return core::usage_error(
        fmt::format("--color {}: {} has no {} of its points{}; choose rgb, height or normal",
                    viz::color_mode_name(mode), input.string(), what, why));
  };

  // Values by mode
  if (mode == viz::ColorMode::kConfidence) {
    if (file.columns.confidence.empty()) return missing("confidence");
    scene.scalars = file.columns.confidence;
    scene.scalar_label = "confidence";
  } else if (mode == viz::ColorMode::kSigma) {
    for (const auto& column : file.columns.others) {
      if (column.name == cloud::kSigmaColumn) scene.scalars = column.values;
    }

    if (scene.scalars.empty())
      return missing("sigma", " (summary.json of its run says why: refine, sigma_note)");
    scene.scalar_label = "standard deviation (m)";
  } else if (mode == viz::ColorMode::kRobot) {
    if (file.columns.robot.empty()) return missing("robot");
    scene.scalars.assign(file.columns.robot.begin(), file.columns.robot.end());
  } else if (mode == viz::ColorMode::kError) {
    const auto data = input.extension() == ".ply" ? cloud::read_ply(input) : core::Result<cloud::PlyData>();

    const std::vector<float>* errors = data ? data->floats("error") : nullptr;
    if (errors == nullptr || errors->size() != file.cloud->size()) return missing("error");
    scene.scalars = *errors;
    scene.scalar_label = "error (m)";
  }
  return {};
}

/// Checks the name of the output before anything is drawn.
core::Result<void> check_ending(const RenderRequest& request) {
  if (request.turntable == 0) {
    if (request.output.extension() == ".png") return {};
    return core::usage_error(
        fmt::format("{}: pictures are PNG; let the name end in .png", request.output.string()));
  }
  if (is_film(request.output)) return can_film();
  if (!request.output.has_extension()) return {};
  return core::usage_error(
      fmt::format("{}: a turntable is a folder of pictures, .gif or .mp4", request.output.string()));
}

/// All round: a folder of pictures, or a film of them.
core::Result<void> turn(const RenderRequest& request, const viz::Scene& scene, Console& console) {
  // A film is made of pictures
  constexpr int kPicturesPerSecond = 15;
  const bool film = is_film(request.output);
  fs::path folder = request.output;
  if (film) folder += ".pictures";

  // Foreign pictures must not be removed
  std::error_code ignored;
  if (film && fs::exists(folder, ignored)) {
    return core::usage_error(
        fmt::format("{}: is in the way: the film's pictures are first written there; move it elsewhere",
                    folder.string()));
  }

  // The pictures of a film are removed again
  auto drawn =
      viz::render_turntable(scene, request.options, request.turntable, folder, console.counting("pictures"));
  console.end_progress();
  if (!film) return drawn;
  if (drawn) drawn = make_film(folder, kPicturesPerSecond, request.output);
  const auto removed = core::remove_own_files(folder, {"*.png"});
  return drawn ? removed : drawn;
}

core::Result<void> render(RenderRequest& request, Session& session) {
  // Options that contradict each other
  if (auto applied = request.flags.apply(); !applied) return applied;
  if (!request.size.empty()) {
    const std::set<std::string> given = request.flags.given();
    if (given.count("width") + given.count("height") > 0)
      return core::usage_error("--size: says the same as --width and --height; give only one of them");
    if (auto parsed = parse_size(request.size, request.options); !parsed) return parsed;
  }
  if (auto checked = check_ending(request); !checked) return checked;
  if (auto free = maps::check_output(request.output, {request.input}); !free) return free;

  // A cloud file or a map
  const auto found = map_of(request.input, request.robot);
  if (!found) return tl::unexpected<core::Error>(found.error());
  const std::optional<maps::MapPlace>& place = *found;
  std::error_code ec;
  const bool cloud_file = fs::is_regular_file(request.input, ec) && request.input.extension() != ".db";
  const auto file = cloud_file ? cloud::read_cloud(request.input, cloud::LargeCoordinates::kShifted)
                               : maps::read_map_cloud(*place, session.executor());
  if (!file) return tl::unexpected<core::Error>(file.error());

  // Empty clouds still give a picture
  if (file->cloud->empty()) {
    session.console().warning(fmt::format("{}: the {} has no points", request.input.string(),
                                          cloud_file ? "cloud" : "map's cloud"));
  }
  if (!file->shift.isZero(0.0)) session.console().info("shift: " + shift_text(file->shift));
  viz::Scene scene;
  scene.cloud = file->cloud;
  scene.title = display_name(place && place->result ? place->result->folder : request.input);

  // Paths and lines of the map
  if (place) {
    if (auto added = add_paths(*place, request.lines, scene); !added) return added;
  } else if (request.lines) {
    return core::usage_error("--lines: only a result folder has lines");
  }

  // Colours and the upward direction
  const fs::path colours = cloud_file || !place->result ? request.input : place->result->ply();
  if (auto added = add_scalars(*file, colours, request.options.color, scene); !added) return added;
  const cloud::CloudFrame frame = cloud_file ? maps::frame_of_cloud(request.input, file->frame) : file->frame;
  if (frame.up() == cloud::Up::kZ) request.options.up = Eigen::Vector3d::UnitZ();
  if (request.turntable > 0) return turn(request, scene, session.console());
  return viz::render_snapshot(scene, request.options, request.output);
}

}  // namespace

void add_render(CLI::App& app, Session& session) {
  // Input and output
  const auto request = std::make_shared<RenderRequest>();
  CLI::App* command = add_command(app, session, "render", "Draw a map or cloud; needs no display",
                                  [&session, request] { return render(*request, session); });
  command->add_option("INPUT", request->input, "A result folder, map.db, or a PLY, PCD or XYZ file")
      ->required();

  command->add_option("-o,--output", request->output, "Picture to write")
      ->required()
      ->type_name("FILE.png|DIR|.gif|.mp4");
  command
      ->add_option("--robot", request->robot,
                   "Robot whose map to use, for an interrupted run of several robots")
      ->type_name("NAME");
  command->add_option("--size", request->size, "Size of the picture, like 1600x1200")->type_name("WxH");

  // Several pictures, lines and views
  command
      ->add_option("--turntable", request->turntable,
                   "Number of pictures from all sides, written to a folder, or as .gif or .mp4 with ffmpeg")
      ->check(CLI::Range(2, 3600))
      ->type_name("N");
  command->add_flag("--lines", request->lines, "Draw the map's 3D lines, too");
  add_progress_option(*command, session);
  request->flags.add(*command, request->options);
}

}  // namespace plumbline::cli
