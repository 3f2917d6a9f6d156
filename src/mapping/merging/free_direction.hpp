// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Directions in which surfaces do not constrain the relative pose of two maps: along a corridor or a lone
// wall only images do, and similar things may be repeated there.
#include <Eigen/Core>
#include <vector>

#include "plumbline/mapping/merging/map_fusion.hpp"

namespace plumbline::mapping {

/// The direction that the surfaces of the agreeing keyframes constrain least.
struct FreeDirection {
  /// Mean squared cosine of their normals with it; 0: unconstrained, 1/3: constrained like all others.
  double held = 0.0;
  double held_next = 0.0;  ///< the same for the next direction: also small in front of a lone wall
  double reach_m = 0.0;    ///< extent of the cameras along it (or along the wall), the smaller of both maps
  /// True if surfaces do not constrain it.
  [[nodiscard]] bool slides() const { return held < kHeld; }
  /// True if they constrain the two other directions: a corridor.
  [[nodiscard]] bool corridor() const { return slides() && held_next > kHeldWell; }

  static constexpr double kHeld = 0.01;  ///< value if one sample in a hundred faced it
  static constexpr double kHeldWell = 0.1;
};

FreeDirection free_direction(const maps::Map& a, const maps::Map& b, const geometry::Rigid3& a_from_b,
                             const std::vector<VerifiedPair>& agreeing);

}  // namespace plumbline::mapping
