// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Formats of trajectories: one source for each, and the table of all in trajectory_formats.cpp.
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "plumbline/dataset/trajectory_io.hpp"
#include "text_lines.hpp"

namespace plumbline::dataset {

/// Which word of a row is what; the order is stamp, tx ty tz, qx qy qz qw.
struct TrajectoryColumns {
  std::array<std::size_t, 8> at{};
  bool nanoseconds = false;  ///< EuRoC's own names (p_RS_R_x), which it writes nanoseconds with
  std::string stamp_name;    ///< name of the stamp's column, with its unit
};

struct TrajectoryText {
  std::string file;
  std::vector<TextLine> rows;  ///< without comments and header
  bool commas = false;         ///< the first row is separated by commas
  std::optional<TrajectoryColumns> header;

  [[nodiscard]] tl::unexpected<core::Error> wrong(int line, const std::string& what) const;
  /// The words of a row as numbers, those that are not finite among them.
  [[nodiscard]] core::Result<std::vector<double>> numbers(const TextLine& row) const;
};

/// A row without its place: none where a value is not finite.
using PoseOfRow = std::optional<geometry::StampedPose>;

struct TrajectoryFormat {
  const char* name;
  bool stamped;
  bool (*recognises)(const TrajectoryText& text);
  /// `n`: the row's numbers, of which `stamp` is filled in also when the rest is not finite.
  core::Result<PoseOfRow> (*read_row)(const TrajectoryText& text, const TextLine& row, double& stamp);
};

extern const TrajectoryFormat kKittiTrajectory;
extern const TrajectoryFormat kEurocTrajectory;
extern const TrajectoryFormat kTumTrajectory;  ///< last: every other file

/// Pose from the row's numbers by columns. Stamps are in the unit that the header names, else in the one that
/// makes the first of them a time since 1970: nanoseconds, microseconds, milliseconds or seconds.
core::Result<PoseOfRow> read_columns(const TrajectoryText& text, const TextLine& row,
                                     const TrajectoryColumns& columns, double& stamp);

}  // namespace plumbline::dataset
