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
};

/// The path from above (the two axes along which the truth moves most), coloured by error, truth dashed.
Figure path_figure(const TrajectoryComparison& comparison);
/// Error over time, with its median and RMS.
Figure error_figure(const TrajectoryComparison& comparison);
/// x, y, z over time (left) and roll, pitch, yaw over time (right), estimate and truth.
Figure pose_figure(const TrajectoryComparison& comparison);
/// Box plot and histogram of the errors of several estimates.
Figure error_distribution_figure(const std::vector<TrajectoryComparison>& comparisons);
/// Milliseconds per frame and, if given, resident memory (MB) over frame number.
Figure resources_figure(const std::vector<double>& frame_ms, const std::vector<double>& memory_mb);

/// <folder>/<name>.png and <folder>/<name>.svg.
core::Result<void> write_figure(const Figure& figure, const std::filesystem::path& folder,
                                const std::string& name);

/// Writes path, error, poses and error_distribution. Errors: kUsage when lengths differ, kOutput.
core::Result<void> write_trajectory_plots(const TrajectoryComparison& comparison,
                                          const std::filesystem::path& folder);

}  // namespace plumbline::viz
