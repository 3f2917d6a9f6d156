// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What samples of voxels share, whether a view makes them or a map takes them up.
#include <Eigen/Core>
#include <algorithm>
#include <cstdint>

#include "plumbline/cloud/voxel_map.hpp"

namespace plumbline::cloud {

inline constexpr int kAxisBits = 21;
inline constexpr std::int64_t kHalf = std::int64_t{1} << (kAxisBits - 1);
inline constexpr float kOpposed = -0.2F;  // a fold of up to 100 degrees is still one side

/// Finds the sample's voxel; false when it is out of reach.
inline bool locate(const Eigen::Vector3d& position, double voxel_m, VoxelSample& sample) {
  const double per_m = 1.0 / voxel_m;
  std::uint64_t key = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double at = position[axis] * per_m;
    if (!(at >= static_cast<double>(-kHalf) && at < static_cast<double>(kHalf))) return false;
    // A cast and a step: there is no instruction for floor() on every machine.
    auto cell = static_cast<std::int64_t>(at);
    cell -= at < static_cast<double>(cell) ? 1 : 0;
    sample.offset[axis] = static_cast<float>(position[axis] - (static_cast<double>(cell) + 0.5) * voxel_m);
    key = key << kAxisBits | static_cast<std::uint64_t>(cell + kHalf);
  }
  sample.key = key << 1;  // the lowest bit is the side
  return true;
}

/// Who measured most: whoever has more than all others together is found (Boyer and Moore).
template <typename Into>
void vote(std::uint32_t robot, std::uint32_t votes, Into& into) {
  constexpr std::uint32_t kMost = 0x7FFFFFU;
  if (into.robot == robot) {
    into.robot_lead = std::min(kMost, into.robot_lead + votes) & kMost;
  } else if (votes > into.robot_lead) {
    into.robot = robot & 0xFFU;
    into.robot_lead = (votes - into.robot_lead) & kMost;
  } else {
    into.robot_lead = (into.robot_lead - votes) & kMost;
  }
}

}  // namespace plumbline::cloud
