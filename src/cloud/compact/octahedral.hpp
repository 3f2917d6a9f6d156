// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Unit vectors in two bytes: the octahedron |x| + |y| + |z| = 1 unfolded to a square (Meyer et al., "On
// floating-point normal vectors", EGSR 2010).
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

namespace plumbline::cloud {

inline constexpr std::array<std::uint8_t, 2> kUnknownDirection{255, 255};

/// Each of the two values in 0-254; kUnknownDirection for a vector that is not finite or zero.
inline std::array<std::uint8_t, 2> pack_direction(const Eigen::Vector3f& v) {
  const float sum = std::abs(v.x()) + std::abs(v.y()) + std::abs(v.z());
  if (!std::isfinite(sum) || !(sum > 1e-6F)) return kUnknownDirection;
  float a = v.x() / sum;
  float b = v.y() / sum;
  if (v.z() < 0.0F) {
    const float folded = (1.0F - std::abs(b)) * (a < 0.0F ? -1.0F : 1.0F);
    b = (1.0F - std::abs(a)) * (b < 0.0F ? -1.0F : 1.0F);
    a = folded;
  }
  const auto byte = [](float s) {
    return static_cast<std::uint8_t>(std::clamp(std::lround(127.0F * s) + 127L, 0L, 254L));
  };
  return {byte(a), byte(b)};
}

/// Unit length; NaN for kUnknownDirection.
inline Eigen::Vector3f unpack_direction(const std::array<std::uint8_t, 2>& packed) {
  if (packed == kUnknownDirection) {
    return Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN());
  }
  const float a = (static_cast<float>(packed[0]) - 127.0F) / 127.0F;
  const float b = (static_cast<float>(packed[1]) - 127.0F) / 127.0F;
  Eigen::Vector3f v(a, b, 1.0F - std::abs(a) - std::abs(b));
  const float under = std::max(-v.z(), 0.0F);
  v.x() += v.x() >= 0.0F ? -under : under;
  v.y() += v.y() >= 0.0F ? -under : under;
  return v.normalized();
}

}  // namespace plumbline::cloud
