// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Paths of several robots: in one file, or in a folder with one each.
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "plumbline/core/output_file.hpp"
#include "source/map_source.hpp"

namespace plumbline::exports {

/// Function of a format that writes the robots' paths, each in order of time, into one file.
using WritePaths = std::function<void(core::OutputFile&, const std::vector<std::vector<ExportPose>>&)>;

/// body_from_camera by robot.
struct BodyMounts {
  geometry::Rigid3 of_all;  ///< of robots that are not in `by_robot`
  std::map<std::int32_t, geometry::Rigid3> by_robot;

  [[nodiscard]] const geometry::Rigid3& of(std::int32_t robot) const {
    const auto found = by_robot.find(robot);
    return found == by_robot.end() ? of_all : found->second;
  }
};
/// The camera's pose in the body of --body; the identity without it. Errors: kUsage: not a pose; kInput: the
/// recording does not know its base, or cannot be opened.
core::Result<BodyMounts> body_mounts(const MapSource& source);
/// The selected poses, by robot: poses of the body if --body is given. Errors: those of body_mounts and
/// MapSource::poses.
core::Result<std::vector<std::vector<ExportPose>>> paths_of(const MapSource& source);

/// Writes one file, or if `output` has no extension a folder with ROBOT<ending> for each robot.
core::Result<ExportSummary> write_robot_files(const MapSource& source, const std::filesystem::path& output,
                                              const std::string& ending, const WritePaths& write);
/// A comment line that names the robot; "" if there is only one.
std::string robot_comment(const std::vector<ExportPose>& path);

}  // namespace plumbline::exports
