// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What laying maps over each other and looking for steps between their landmarks share.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "plumbline/features/descriptor.hpp"
#include "plumbline/geometry/rigid3.hpp"

namespace plumbline::mapping {

using Cell = std::array<int, 3>;

inline Cell cell_of(const Eigen::Vector3d& p, double size) {
  const Eigen::Vector3d scaled = p / size;
  return {static_cast<int>(std::floor(scaled.x())), static_cast<int>(std::floor(scaled.y())),
          static_cast<int>(std::floor(scaled.z()))};
}

inline Cell corner_of(const Cell& low, int corner, int sign = 1) {
  return {low[0] + sign * (corner & 1), low[1] + sign * (corner >> 1 & 1), low[2] + sign * (corner >> 2)};
}

/// Every how manieth, so that no more than `most` are taken.
inline std::size_t stride(std::size_t count, std::size_t most) {
  return std::max<std::size_t>(1, (count + most - 1) / most);
}

/// Hamming distance of landmarks that may be one.
constexpr int kAlike = 50;
inline bool alike(const features::Descriptor256& a, const features::Descriptor256& b) {
  return features::hamming_distance(a, b) <= kAlike;
}

}  // namespace plumbline::mapping
