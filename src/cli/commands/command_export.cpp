// SPDX-License-Identifier: BSD-3-Clause
// plumbline export MAP -o FILE|--keyframes DIR
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>
#include <system_error>

#include "app.hpp"
#include "option_flags.hpp"
#include "plumbline/cloud/cloud_io.hpp"
#include "plumbline/cloud/mesh.hpp"
#include "plumbline/dataset/trajectory_io.hpp"
#include "plumbline/maps/line_export.hpp"
#include "plumbline/maps/stored_result.hpp"
#include "silenced_stdio.hpp"

namespace plumbline::cli {
namespace {

struct ExportRequest {
  std::filesystem::path input;
  std::filesystem::path output;
  std::string robot;
  std::string what = "cloud";
  bool trajectory = false;
  bool lines = false;
  std::filesystem::path keyframes;  ///< folder for the clouds of keyframes; empty: none
  std::string voxel;                ///< of a cloud that is laid down anew; empty: as it was mapped
  bool mesh = false;
  cloud::MeshOptions mesh_options;
  OptionFlags flags;
};

/// Whether the run wrote this file, so that the store need not be asked.
bool written(const maps::MapPlace& place, const std::filesystem::path& file) {
  std::error_code ec;
  return place.store.empty() || (place.result && std::filesystem::exists(file, ec));
}

core::Result<geometry::Trajectory> path_of(const maps::MapPlace& place, bool keyframes) {
  const maps::ResultFolder folder = place.result.value_or(maps::ResultFolder{});
  const std::filesystem::path file = keyframes ? folder.keyframes() : folder.trajectory();
  if (written(place, file)) return dataset::read_trajectory(file);
  const auto stored = maps::StoredResult::open(place);
  if (!stored) return tl::unexpected<core::Error>(stored.error());
  return keyframes ? stored->keyframe_trajectory() : stored->trajectory();
}

core::Result<void> export_path(const maps::MapPlace& place, bool keyframes, const std::filesystem::path& to) {
  if (to.extension() != ".txt" && to.extension() != ".ply") {
    return core::usage_error(fmt::format("{}: paths are written as .txt (TUM format) or .ply", to.string()));
  }
  const auto trajectory = path_of(place, keyframes);
  if (!trajectory) return tl::unexpected<core::Error>(trajectory.error());
  if (to.extension() == ".txt") return dataset::write_trajectory(to, *trajectory);
  return maps::write_trajectory_ply(to, *trajectory);
}

core::Result<void> export_lines(const maps::MapPlace& place, const std::filesystem::path& to) {
  if (to.extension() != ".ply") {
    return core::usage_error(fmt::format("{}: lines are written as .ply", to.string()));
  }
  const maps::ResultFolder folder = place.result.value_or(maps::ResultFolder{});
  if (written(place, folder.lines())) {
    const auto lines = maps::read_lines_ply(folder.lines());
    if (!lines) return tl::unexpected<core::Error>(lines.error());
    return maps::write_lines_ply(to, *lines);
  }
  const auto stored = maps::StoredResult::open(place);
  if (!stored) return tl::unexpected<core::Error>(stored.error());
  return maps::write_lines_ply(to, stored->lines());
}

/// The cloud as the run wrote it, or with other voxels from the store.
core::Result<cloud::CloudFile> cloud_of(const maps::MapPlace& place, const ExportRequest& request,
                                        const core::Executor& executor) {
  if (request.voxel.empty()) return maps::read_map_cloud(place, executor);
  const auto fail = [](const core::Error& error) { return tl::unexpected<core::Error>(error); };
  cloud::DenseFusionOptions options;
  core::OptionTable table;
  options.declare(table);
  core::ConfigNode value;
  value.kind = core::ConfigNode::Kind::kScalar;
  value.scalar = request.voxel;
  core::ConfigProblems problems;
  table.set("voxel", value, "--voxel", problems);
  if (!problems.empty()) return core::usage_error("--voxel: " + problems.front().what);
  if (place.store.empty()) {
    return core::usage_error(fmt::format(
        "--voxel: {} has no map.db to lay the cloud down from; map again without store.enabled=off",
        request.input.string()));
  }
  const auto stored = maps::StoredResult::open(place);
  if (!stored) return fail(stored.error());
  const double voxel_m = options.voxels.voxel_m;
  options = stored->fusion_options();
  options.voxels.voxel_m = voxel_m;
  auto fused = stored->fused(options, executor);
  if (!fused) return fail(fused.error());
  cloud::CloudFile file;
  file.cloud = std::move(fused->cloud);
  file.columns = std::move(fused->columns);
  return file;
}

core::Result<void> export_keyframes(const maps::MapPlace& place, const ExportRequest& request) {
  if (place.store.empty()) {
    return core::usage_error(fmt::format(
        "--keyframes: {} has no map.db with the clouds of keyframes; map again without store.enabled=off",
        request.input.string()));
  }
  const auto stored = maps::StoredResult::open(place);
  if (!stored) return tl::unexpected<core::Error>(stored.error());
  const auto count = stored->write_keyframe_clouds(request.keyframes);
  if (!count) return tl::unexpected<core::Error>(count.error());
  return {};
}

/// Whether the input is a cloud by itself.
bool is_cloud_file(const std::filesystem::path& input) {
  constexpr std::array<const char*, 7> kEndings = {".ply", ".pcd", ".xyz", ".txt", ".csv", ".asc", ".pts"};
  std::error_code ec;
  const bool known = std::any_of(kEndings.begin(), kEndings.end(),
                                 [&](const char* ending) { return input.extension() == ending; });
  return known && std::filesystem::is_regular_file(input, ec);
}

core::Result<void> write_as_mesh(const cloud::CloudFile& file, const ExportRequest& request) {
  auto mesh = [&] {
    const SilencedStdio silenced;  // PCL's Poisson prints what it thinks of the points
    return cloud::make_mesh(*file.cloud, request.mesh_options);
  }();
  if (!mesh) return tl::unexpected<core::Error>(mesh.error());
  mesh->shift = {file.shift.x(), file.shift.y(), file.shift.z()};
  return cloud::write_mesh(request.output, *mesh);
}

core::Result<void> write_as_cloud(const cloud::CloudFile& file, const ExportRequest& request) {
  return cloud::write_cloud(request.output, *file.cloud, file.columns, file.shift);
}

core::Result<void> check_cloud_output(const std::filesystem::path& output, bool mesh) {
  const auto extension = output.extension();
  if (extension == ".ply" || extension == (mesh ? ".obj" : ".pcd")) return {};
  return core::usage_error(mesh ? fmt::format("{}: meshes are written as .ply or .obj", output.string())
                                : fmt::format("{}: clouds are written as .ply or .pcd", output.string()));
}

/// A cloud file in another format, its large coordinates kept.
core::Result<void> convert_cloud(const ExportRequest& request, Console& console) {
  if (request.what != "cloud" || request.trajectory || request.lines || !request.voxel.empty() ||
      !request.keyframes.empty()) {
    return core::usage_error(fmt::format("{}: is a cloud, of which only the cloud or a --mesh can be written",
                                         request.input.string()));
  }
  if (auto fits = check_cloud_output(request.output, request.mesh); !fits) return fits;
  const auto file = cloud::read_cloud(request.input, cloud::LargeCoordinates::kShifted);
  if (!file) return tl::unexpected<core::Error>(file.error());
  if (!file->shift.isZero(0.0)) console.info("shift: " + shift_text(file->shift));
  return request.mesh ? write_as_mesh(*file, request) : write_as_cloud(*file, request);
}

core::Result<void> run_export(ExportRequest& request, Session& session) {
  if (auto applied = request.flags.apply(); !applied) return applied;
  if (request.output.empty() && request.keyframes.empty()) {
    return core::usage_error("nothing is to be written; name a file with -o or a folder with --keyframes");
  }
  if (is_cloud_file(request.input)) return convert_cloud(request, session.console());
  const core::Executor& executor = session.executor();
  auto place = maps::find_map(request.input);
  if (!place) return tl::unexpected<core::Error>(place.error());
  place->robot = request.robot;
  if (!request.keyframes.empty()) {
    auto done = export_keyframes(*place, request);
    if (!done || request.output.empty()) return done;
  }
  if (!request.mesh && (request.trajectory || request.what == "trajectory"))
    return export_path(*place, false, request.output);
  if (request.what == "keyframes") return export_path(*place, true, request.output);
  if (!request.mesh && (request.lines || request.what == "lines"))
    return export_lines(*place, request.output);
  if (auto fits = check_cloud_output(request.output, request.mesh); !fits) return fits;
  const auto file = cloud_of(*place, request, executor);
  if (!file) return tl::unexpected<core::Error>(file.error());
  return request.mesh ? write_as_mesh(*file, request) : write_as_cloud(*file, request);
}

}  // namespace

void add_export(CLI::App& app, Session& session) {
  const auto request = std::make_shared<ExportRequest>();
  CLI::App* command = add_command(app, session, "export", "Write parts of a map in other formats",
                                  [&session, request] { return run_export(*request, session); });
  command
      ->add_option("MAP", request->input,
                   "A result folder, also of a run that was interrupted, map.db, or a cloud file")
      ->required();
  command->add_option("-o,--output", request->output, "File to write")->type_name("FILE.ply|.pcd|.obj|.txt");
  command
      ->add_option("--keyframes", request->keyframes,
                   "Write the cloud of every keyframe as DIR/<number>.ply, from map.db")
      ->type_name("DIR");
  command->add_option("--voxel", request->voxel, "Fuse the cloud again from map.db, with voxels of this size")
      ->type_name("LENGTH");
  command
      ->add_option("--robot", request->robot,
                   "Robot whose map to use, for an interrupted run of several robots")
      ->type_name("NAME");
  CLI::Option* what = command->add_option("--what", request->what, "What to write (default: cloud)")
                          ->check(CLI::IsMember({"cloud", "trajectory", "keyframes", "lines"}));
  CLI::Option* trajectory =
      command->add_flag("--trajectory", request->trajectory, "The same as --what trajectory")->excludes(what);
  command->add_flag("--lines", request->lines, "The same as --what lines")
      ->excludes(what)
      ->excludes(trajectory);
  command->add_flag("--mesh", request->mesh, "Write the cloud as a mesh, .ply or .obj")->excludes(what);
  request->flags.add(*command, request->mesh_options);
}

}  // namespace plumbline::cli
