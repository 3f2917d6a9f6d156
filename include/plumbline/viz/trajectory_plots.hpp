// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The usual charts of a trajectory evaluation, from plain data. Each call writes <name>.png and <name>.svg
// into `folder` (made if missing).
#include <filesystem>
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/geometry/trajectory.hpp"
#include "plumbline/viz/figure.hpp"

namespace plumbline::viz {

/// One estimate beside its truth, already associated and aligned: estimate[i] belongs to truth[i].
struct TrajectoryComparison {
  std::string name;               ///< "full pipeline", "without lines" ...
  geometry::Trajectory estimate;  ///< in the truth's frame
  geometry::Trajectory truth;     ///< same length and stamps; empty = no truth, only the estimate is drawn
  std::vector<double> error_m;    ///< absolute position error per pose; empty = taken from the positions
  geometry::Trajectory whole_truth{};  ///< drawn instead of `truth`, also where nothing was estimated
};

// Each figure shows one estimate or several side by side. Curves are broken where poses are missing for more
// than five usual steps and 0.25 s: tracking was lost there.

/// The path from above (the two axes along which the truth moves most), coloured by error, truth dashed; one
/// panel per estimate with the same colours.
Figure path_figure(const std::vector<TrajectoryComparison>& comparisons);
/// Error over time, with its median and RMS.
Figure error_figure(const std::vector<TrajectoryComparison>& comparisons);
/// x, y, z over time (left) and roll, pitch, yaw over time (right), estimates and truth.
Figure pose_figure(const std::vector<TrajectoryComparison>& comparisons);
/// Box plot and histogram of the errors of several estimates.
Figure error_distribution_figure(const std::vector<TrajectoryComparison>& comparisons);
/// Milliseconds per frame and, if given, resident memory (MB) over frame number.
Figure resources_figure(const std::vector<double>& frame_ms, const std::vector<double>& memory_mb);

/// <folder>/<name>.png and <folder>/<name>.svg.
core::Result<void> write_figure(const Figure& figure, const std::filesystem::path& folder,
                                const std::string& name);

/// Writes path, error, poses and error_distribution. Errors: kUsage when lengths differ or there is no
/// estimate, kOutput.
core::Result<void> write_trajectory_plots(const std::vector<TrajectoryComparison>& comparisons,
                                          const std::filesystem::path& folder);

}  // namespace plumbline::viz
