// SPDX-License-Identifier: BSD-3-Clause
// TUM RGB-D: "stamp tx ty tz qx qy qz qw", seconds, separated by blanks (or commas). ORB-SLAM writes the same
// with nanoseconds.
#include "trajectories/trajectory_formats.hpp"

namespace plumbline::dataset {
namespace {

bool is_tum(const TrajectoryText& /*text*/) { return true; }

core::Result<PoseOfRow> read_tum_row(const TrajectoryText& text, const TextLine& row, double& stamp) {
  TrajectoryColumns columns;
  columns.at = {0, 1, 2, 3, 4, 5, 6, 7};
  return read_columns(text, row, text.header.value_or(columns), stamp);
}

}  // namespace

const TrajectoryFormat kTumTrajectory = {"TUM", true, &is_tum, &read_tum_row};

}  // namespace plumbline::dataset
