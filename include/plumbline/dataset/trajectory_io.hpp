// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Trajectories of any program: TUM ("stamp tx ty tz qx qy qz qw" per line), EuRoC and TUM-VI (csv,
// nanoseconds, w first), KITTI (12 numbers a row without stamps). '#' starts a comment. They are written in
// TUM's format.
#include <filesystem>
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/geometry/trajectory.hpp"

namespace plumbline::dataset {

struct TrajectoryReading {
  geometry::Trajectory poses;      ///< sorted by stamp; without stamps the row is the stamp: 0, 1, 2 ...
  std::string format;              ///< "TUM", "EuRoC", "KITTI"
  bool stamped = true;             ///< the file has stamps
  std::vector<double> rows;        ///< stamps of all rows in the file's order, also of those left out
  std::vector<std::string> notes;  ///< remarks for a reader of the numbers, one sentence each
};

/// Reads a trajectory of any format, recognised by its rows and its header; a header with column names gives
/// their order. Rows with a value that is not finite are left out and counted in the notes; poses that share
/// a stamp are counted too, and kept in the file's order. Errors (kInput) name file and line: missing
/// columns, not a number, decimal commas, zero quaternion, not a rotation; no finite row at all.
core::Result<TrajectoryReading> read_trajectory_file(const std::filesystem::path& file);

/// Only the poses, of a file with stamps (without: kInput). `notes`, if given, gets the notes of reading.
core::Result<geometry::Trajectory> read_trajectory(const std::filesystem::path& file,
                                                   std::vector<std::string>* notes = nullptr);

/// True if the file's first row is a pose: distinguishes trajectories from point clouds.
bool holds_poses(const std::filesystem::path& file);

/// Gives poses without stamps those of the other file's rows with the same number, and says so in the notes
/// of `estimate`; if neither file has stamps, rows are 0.1 s apart, as in KITTI. Error (kInput): the files
/// have different numbers of rows.
core::Result<void> pair_by_number(TrajectoryReading& estimate, TrajectoryReading& truth);

/// Stamps with 6 decimals, positions and quaternions with 9; written to a temporary file and renamed.
core::Result<void> write_trajectory(const std::filesystem::path& file,
                                    const geometry::Trajectory& trajectory);

}  // namespace plumbline::dataset
