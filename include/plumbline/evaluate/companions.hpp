// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Trajectories that lie beside a cloud and its reference.
#include <filesystem>
#include <string>
#include <vector>

namespace plumbline::evaluate {

struct TrajectoryFiles {
  std::string robot;  ///< "" when there is one only
  std::filesystem::path estimate;
  std::filesystem::path truth;
};

/// Pairs by robot: <cloud folder>/trajectory.txt with <reference folder>/groundtruth.txt or, if just one
/// subfolder has one, with that; <cloud folder>/robots/<name>/trajectory.txt with <reference
/// folder>/<name>/groundtruth.txt. Empty when nothing fits together without a guess. `cloud` and `reference`
/// are files; sorted by robot.
std::vector<TrajectoryFiles> find_trajectories(const std::filesystem::path& cloud,
                                               const std::filesystem::path& reference);

}  // namespace plumbline::evaluate
