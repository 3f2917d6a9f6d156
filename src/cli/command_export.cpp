// SPDX-License-Identifier: BSD-3-Clause
// plumbline export MAP -o FILE
#include <fmt/format.h>

#include <memory>

#include "app.hpp"
#include "option_flags.hpp"
#include "plumbline/cloud/cloud_io.hpp"
#include "plumbline/cloud/mesh.hpp"
#include "plumbline/dataset/trajectory_io.hpp"
#include "plumbline/maps/line_export.hpp"
#include "plumbline/pipeline/result_folder.hpp"

namespace plumbline::cli {
namespace {

struct ExportRequest {
  std::filesystem::path input;
  std::filesystem::path output;
  std::string what = "cloud";
  bool mesh = false;
  cloud::MeshOptions mesh_options;
  core::OptionTable table;
  std::unique_ptr<OptionFlags> flags;
};

core::Result<void> export_path(const std::filesystem::path& from, const std::filesystem::path& to) {
  const auto trajectory = dataset::read_trajectory(from);
  if (!trajectory) return tl::unexpected<core::Error>(trajectory.error());
  if (to.extension() == ".txt") return dataset::write_trajectory(to, *trajectory);
  if (to.extension() == ".ply") return pipeline::write_trajectory_ply(to, *trajectory);
  return core::usage_error(fmt::format("{}: paths are written as .txt (TUM format) or .ply", to.string()));
}

core::Result<void> export_lines(const std::filesystem::path& from, const std::filesystem::path& to) {
  if (to.extension() != ".ply") {
    return core::usage_error(fmt::format("{}: lines are written as .ply", to.string()));
  }
  const auto lines = pipeline::read_lines_ply(from);
  if (!lines) return tl::unexpected<core::Error>(lines.error());
  return maps::write_lines_ply(to, *lines);
}

core::Result<void> export_mesh(const pipeline::ResultFolder& result, const ExportRequest& request) {
  if (request.output.extension() != ".ply" && request.output.extension() != ".obj") {
    return core::usage_error(fmt::format("{}: meshes are written as .ply or .obj", request.output.string()));
  }
  const auto file = pipeline::read_result_cloud(result);
  if (!file) return tl::unexpected<core::Error>(file.error());
  const auto mesh = cloud::make_mesh(*file->cloud, request.mesh_options);
  if (!mesh) return tl::unexpected<core::Error>(mesh.error());
  return cloud::write_mesh(request.output, *mesh);
}

core::Result<void> run_export(const ExportRequest& request) {
  if (auto applied = request.flags->apply(); !applied) return applied;
  const auto result = pipeline::open_result(request.input);
  if (!result) return tl::unexpected<core::Error>(result.error());
  if (request.mesh) return export_mesh(*result, request);
  if (request.what == "trajectory") return export_path(result->trajectory(), request.output);
  if (request.what == "keyframes") return export_path(result->keyframes(), request.output);
  if (request.what == "lines") return export_lines(result->lines(), request.output);
  const auto extension = request.output.extension();
  if (extension != ".ply" && extension != ".pcd") {
    return core::usage_error(fmt::format("{}: clouds are written as .ply or .pcd", request.output.string()));
  }
  const auto file = pipeline::read_result_cloud(*result);
  if (!file) return tl::unexpected<core::Error>(file.error());
  return cloud::write_cloud(request.output, *file->cloud, file->columns);
}

}  // namespace

void add_export(CLI::App& app, Session& session) {
  const auto request = std::make_shared<ExportRequest>();
  CLI::App* command =
      add_command(app, session, "export", "Write parts of a map in other formats", [&session, request] {
        const auto done = run_export(*request);
        return done ? 0 : session.fail(done.error());
      });
  command->add_option("MAP", request->input, "A result folder")->required();
  command->add_option("-o,--output", request->output, "File to write")
      ->required()
      ->type_name("FILE.ply|.pcd|.obj|.txt");
  CLI::Option* what = command->add_option("--what", request->what, "What to write (default: cloud)")
                          ->check(CLI::IsMember({"cloud", "trajectory", "keyframes", "lines"}));
  command->add_flag("--mesh", request->mesh, "Write the cloud as a mesh, .ply or .obj")->excludes(what);
  request->mesh_options.declare(request->table);
  request->flags = std::make_unique<OptionFlags>(*command, request->table);
}

}  // namespace plumbline::cli
