// SPDX-License-Identifier: BSD-3-Clause
#include "paths/robot_files.hpp"

#include <fmt/format.h>

#include <cmath>

#include "plumbline/core/text.hpp"

namespace plumbline::exports {

/// The camera's pose in the body of --body; the identity without it.
core::Result<geometry::Rigid3> body_from_camera_of(const ExportOptions& options) {
  const std::vector<double>& body = options.body;
  if (body.empty()) return geometry::Rigid3{};
  if (body.size() != 7) return core::usage_error("--body: takes x,y,z,qx,qy,qz,qw of the camera in the body");
  const Eigen::Quaterniond turn(body[6], body[3], body[4], body[5]);
  if (std::abs(turn.norm() - 1.0) > 0.01)
    return core::usage_error("--body: qx,qy,qz,qw are not a rotation: their squares must add up to 1");
  return geometry::Rigid3(turn, {body[0], body[1], body[2]});
}

/// Selected paths of camera or body, one for each robot.
core::Result<std::vector<std::vector<ExportPose>>> paths_of(const MapSource& source) {
  const auto body_from_camera = body_from_camera_of(source.options());
  if (!body_from_camera) return tl::unexpected(body_from_camera.error());
  auto poses = source.poses(source.request().content == Content::kKeyframes);
  if (!poses) return tl::unexpected(poses.error());

  // Poses are sorted by robot
  const geometry::Rigid3 camera_from_body = body_from_camera->inverse();
  std::vector<std::vector<ExportPose>> paths;
  for (ExportPose& pose : *poses) {
    if (!source.options().body.empty()) pose.world_from_camera = pose.world_from_camera * camera_from_body;
    if (paths.empty() || paths.back().back().robot != pose.robot) paths.emplace_back();
    paths.back().push_back(pose);
  }
  return paths;
}

std::string robot_comment(const std::vector<ExportPose>& path) {
  return path.front().robot_name.empty()
             ? ""
             : fmt::format("# robot {}\n", core::printable(path.front().robot_name));
}

/// Writes all paths into one file, or each into a file of a folder.
core::Result<ExportSummary> write_robot_files(const MapSource& source, const std::filesystem::path& output,
                                              const std::string& ending, const WritePaths& write) {
  const auto paths = paths_of(source);
  if (!paths) return tl::unexpected(paths.error());

  // A name with an ending is one file
  ExportSummary summary;
  if (output.has_extension()) {
    core::OutputFile out(output);
    write(out, *paths);
    if (auto written = out.commit(); !written) return tl::unexpected(written.error());
    summary.written = {output};
    return summary;
  }
  if (auto made = core::make_folder(output); !made) return tl::unexpected(made.error());

  // A file for each robot, named after it
  for (const auto& path : *paths) {
    const std::string& robot = path.front().robot_name;
    const std::filesystem::path file =
        output / (core::folder_name(robot.empty() ? source.name() : robot) + ending);
    core::OutputFile out(file);
    write(out, {path});
    if (auto written = out.commit(); !written) return tl::unexpected(written.error());
    summary.written.push_back(file);
  }

  return summary;
}

}  // namespace plumbline::exports
