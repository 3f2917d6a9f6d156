// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>

#include "plumbline/geometry/rigid3.hpp"

namespace plumbline::geometry {

inline constexpr std::size_t kPoseSamples = 32;

/// Possible errors of a pose, each drawn together with those of all other poses of a map: small motions
/// (t, w), metres and radians. A point p that the pose has placed may lie at p + t + w x p as well. Axes and
/// origin are those of the map, or of the camera where that is said. NaN: not known.
using PoseSamples = std::array<Vector6d, kPoseSamples>;

}  // namespace plumbline::geometry
