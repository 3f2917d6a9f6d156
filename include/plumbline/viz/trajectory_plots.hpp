// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The usual charts of a trajectory evaluation, from plain data. As SVG.
#include <filesystem>
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/geometry/trajectory.hpp"
#include "plumbline/viz/svg_chart.hpp"

namespace plumbline::viz {

/// One estimate beside its truth, already associated and aligned: estimate[i] belongs to truth[i].
struct TrajectoryComparison {
  std::string name;               ///< "full pipeline", "without lines" ...
  geometry::Trajectory estimate;  ///< in the truth's frame
  geometry::Trajectory truth;     ///< same length and stamps; empty = no truth, only the estimate is drawn
  std::vector<double> error_m;    ///< absolute position error per pose; empty = taken from the positions
  geometry::Trajectory whole_truth{};  ///< drawn instead of `truth`, also where nothing was estimated
};

// Charts show one estimate or several. Curves are broken where poses are missing for more than five usual
// steps and 0.25 s: tracking was lost there.

/// The path from above (the two axes along which the truth moves most), coloured by error, truth dashed; one
/// chart per estimate with the same colours.
std::vector<SvgChart> path_charts(const std::vector<TrajectoryComparison>& comparisons);
/// Error over time, with its median and RMS.
SvgChart error_chart(const std::vector<TrajectoryComparison>& comparisons);
/// x, y, z over time (even ones) and roll, pitch, yaw over time (odd ones), estimates and truth.
std::vector<SvgChart> pose_charts(const std::vector<TrajectoryComparison>& comparisons);
/// Share of the poses over the error that they do not exceed.
SvgChart error_distribution_chart(const std::vector<TrajectoryComparison>& comparisons);

/// Writes path, error, poses and error_distribution (.svg) into `folder` (made if missing). Errors: kUsage
/// when lengths differ or there is no estimate, kOutput.
core::Result<void> write_trajectory_plots(const std::vector<TrajectoryComparison>& comparisons,
                                          const std::filesystem::path& folder);

}  // namespace plumbline::viz
