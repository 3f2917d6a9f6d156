// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Paths of several robots: in one file, or in a folder with one each.
#include <functional>
#include <string>
#include <vector>

#include "plumbline/core/output_file.hpp"
#include "source/map_source.hpp"

namespace plumbline::exports {

/// Function of a format that writes the robots' paths, each in order of time, into one file.
using WritePaths = std::function<void(core::OutputFile&, const std::vector<std::vector<ExportPose>>&)>;

/// The selected poses, by robot: poses of the body if --body is given. Errors: those of body_from_camera_of
/// and MapSource::poses.
core::Result<std::vector<std::vector<ExportPose>>> paths_of(const MapSource& source);
/// The pose of --body; the identity without it. Errors (kUsage): not a pose.
core::Result<geometry::Rigid3> body_from_camera_of(const ExportOptions& options);

/// Writes one file, or if `output` has no extension a folder with ROBOT<ending> for each robot.
core::Result<ExportSummary> write_robot_files(const MapSource& source, const std::filesystem::path& output,
                                              const std::string& ending, const WritePaths& write);
/// A comment line that names the robot; "" if there is only one.
std::string robot_comment(const std::vector<ExportPose>& path);

}  // namespace plumbline::exports
