// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Facts about a recording that are known without its images.
#include <filesystem>

#include "plumbline/core/error.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/dataset/trajectory_io.hpp"

namespace plumbline::dataset {

/// True if a file is a recording that open_recording takes, or refuses with advice (.r3d).
bool is_recording_file(const std::filesystem::path& file);

/// True if `file` exists and belongs to a recording's folder: its lists, camera, truth and images, not other
/// files of users.
bool is_part_of_recording(const std::filesystem::path& file);

/// The poses that a recording's folder holds, in whatever layout: truth, or the recorder's own odometry.
/// Error (kInput): no recording, or one without poses.
core::Result<TrajectoryReading> recording_poses(const std::filesystem::path& folder, core::Log& log);

}  // namespace plumbline::dataset
