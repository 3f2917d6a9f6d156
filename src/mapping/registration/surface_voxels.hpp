// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Numbers of voxels and of the ways a surface faces.
#include <Eigen/Core>
#include <cmath>
#include <cstdint>

namespace plumbline::mapping {

constexpr int kVoxelAxisBits = 20;

/// 60 bits, ordered by x, then y, then z; reaches +-2^19 voxels, beyond which places repeat.
inline std::uint64_t voxel_key(const Eigen::Vector3f& p, float voxel_m) {
  std::uint64_t key = 0;
  constexpr std::int64_t kHalf = std::int64_t{1} << (kVoxelAxisBits - 1);
  constexpr std::uint64_t kMask = (std::uint64_t{1} << kVoxelAxisBits) - 1;
  for (int axis = 0; axis < 3; ++axis) {
    const auto cell = static_cast<std::int64_t>(std::floor(p[axis] / voxel_m)) + kHalf;
    key = key << kVoxelAxisBits | (static_cast<std::uint64_t>(cell) & kMask);
  }
  return key;
}

/// Which axis a normal is nearest to, and which way along it: 0-5.
inline std::uint64_t facing(const Eigen::Vector3f& normal) {
  Eigen::Index axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  return static_cast<std::uint64_t>(2 * axis + (normal[axis] < 0.0F ? 1 : 0));
}

}  // namespace plumbline::mapping
