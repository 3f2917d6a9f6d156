// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Trajectories in TUM format: "stamp tx ty tz qx qy qz qw" per line, '#' starts a comment.
#include <filesystem>

#include "plumbline/core/error.hpp"
#include "plumbline/geometry/trajectory.hpp"

namespace plumbline::dataset {

/// Sorted by stamp. Errors name file and line: missing columns, not a number, NaN, zero quaternion.
core::Result<geometry::Trajectory> read_trajectory(const std::filesystem::path& file);

/// Stamps with 6 decimals, positions and quaternions with 9; written to a temporary file and renamed.
core::Result<void> write_trajectory(const std::filesystem::path& file,
                                    const geometry::Trajectory& trajectory);

}  // namespace plumbline::dataset
