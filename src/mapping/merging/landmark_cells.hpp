// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Helpers shared by overlaying maps and by searching for steps between their landmarks.
#include <algorithm>
#include <cstddef>

#include "plumbline/cloud/fusion/cell_map.hpp"
#include "plumbline/features/descriptor.hpp"
#include "plumbline/geometry/rigid3.hpp"

namespace plumbline::mapping {

/// One of the eight cells of a block: `low`, and its neighbours on the side of `sign`.
inline Eigen::Vector3i corner_of(const Eigen::Vector3i& low, int corner, int sign = 1) {
  return low + sign * Eigen::Vector3i(corner & 1, corner >> 1 & 1, corner >> 2);
}

/// Step through `count` items that takes no more than `most` of them.
inline std::size_t stride(std::size_t count, std::size_t most) {
  return std::max<std::size_t>(1, (count + most - 1) / most);
}

/// Largest Hamming distance of landmarks that may be the same.
constexpr int kAlike = 50;
inline bool alike(const features::Descriptor256& a, const features::Descriptor256& b) {
  return features::hamming_distance(a, b) <= kAlike;
}

}  // namespace plumbline::mapping
