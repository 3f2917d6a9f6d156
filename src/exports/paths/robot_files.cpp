// SPDX-License-Identifier: BSD-3-Clause
#include "paths/robot_files.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <sstream>

#include "plumbline/core/text.hpp"
#include "source/pictures.hpp"

namespace plumbline::exports {

namespace {

/// The pose "x,y,z,qx,qy,qz,qw". Errors (kUsage): not a pose.
core::Result<geometry::Rigid3> pose_of_text(const std::string& text) {
  std::istringstream in(text);
  std::vector<double> body;
  for (std::string word; std::getline(in, word, ',');) {
    char* end = nullptr;
    body.push_back(std::strtod(word.c_str(), &end));
    if (word.empty() || *end != '\0' || !(std::abs(body.back()) < 1e4)) body.clear();
  }
  if (body.size() != 7) {
    return core::usage_error(
        fmt::format("--body {}: takes x,y,z,qx,qy,qz,qw of the camera in the body, or base", text));
  }

  const Eigen::Quaterniond turn(body[6], body[3], body[4], body[5]);
  if (std::abs(turn.norm() - 1.0) > 0.01)
    return core::usage_error("--body: qx,qy,qz,qw are not a rotation: their squares must add up to 1");
  return geometry::Rigid3(turn, {body[0], body[1], body[2]});
}

}  // namespace

core::Result<BodyMounts> body_mounts(const MapSource& source) {
  const std::string& body = source.options().body;
  BodyMounts mounts;
  if (body.empty()) return mounts;
  if (body != "base") {
    const auto pose = pose_of_text(body);
    if (!pose) return tl::unexpected(pose.error());
    mounts.of_all = *pose;
    return mounts;
  }

  // The recordings know how their cameras are mounted
  const auto pictures = Pictures::open_recordings(source);
  if (!pictures) return tl::unexpected(pictures.error());
  for (const std::int32_t robot : pictures->robots()) {
    const auto mount = pictures->body_from_camera(robot);
    if (!mount) {
      return core::input_error(
          "--body base: the recording does not say where its base is: it needs odometry and /tf_static from "
          "the base to the camera; give the camera's pose x,y,z,qx,qy,qz,qw instead");
    }
    mounts.by_robot.emplace(robot, *mount);
  }
  return mounts;
}

/// Selected paths of camera or body, one for each robot.
core::Result<std::vector<std::vector<ExportPose>>> paths_of(const MapSource& source) {
  const auto mounts = body_mounts(source);
  if (!mounts) return tl::unexpected(mounts.error());
  auto poses = source.poses(source.request().content == Content::kKeyframes);
  if (!poses) return tl::unexpected(poses.error());

  // Poses are sorted by robot
  std::vector<std::vector<ExportPose>> paths;
  for (ExportPose& pose : *poses) {
    if (!source.options().body.empty())
      pose.world_from_camera = pose.world_from_camera * mounts->of(pose.robot).inverse();
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
