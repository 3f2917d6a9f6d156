// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Trajectories stored beside a cloud and its reference.
#include <filesystem>
#include <string>
#include <vector>

namespace plumbline::evaluate {

struct TrajectoryFiles {
  std::string robot;  ///< "" when there is one only
  std::filesystem::path estimate;
  std::filesystem::path truth;
};

/// Pairs by robot, of files beside `cloud` and `reference`: `trajectory.txt` beside the cloud with
/// `groundtruth.txt` beside the reference or, if just one subfolder there has one, with that;
/// `robots/NAME/trajectory.txt` with `NAME/groundtruth.txt`. Empty if nothing fits together without a guess.
/// Sorted by robot.
std::vector<TrajectoryFiles> find_trajectories(const std::filesystem::path& cloud,
                                               const std::filesystem::path& reference);

/// Names of other files beside a true path that may be true paths, too (groundtruth*.txt, *.csv), sorted;
/// none if its own name does not begin so.
std::vector<std::string> other_truths(const std::filesystem::path& truth);

}  // namespace plumbline::evaluate
