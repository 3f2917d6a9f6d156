// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Directions in which only images fix the relative pose of two maps: a corridor or a lone wall can slide
// along itself, and similar things may stand there again and again.
#include <Eigen/Core>
#include <vector>

#include "plumbline/mapping/merging/map_fusion.hpp"

namespace plumbline::mapping {

/// The direction in which the surfaces of the keyframes that agree hold least.
struct FreeDirection {
  /// Mean squared cosine of their normals with it; 0: nothing holds, 1/3: all directions hold alike.
  double held = 0.0;
  double held_next = 0.0;  ///< the same of the next direction: small too in front of a lone wall
  double reach_m = 0.0;    ///< extent of the cameras along it (or along the wall), the smaller of both maps
  /// Surfaces leave it free.
  [[nodiscard]] bool slides() const { return held < kHeld; }
  /// ... and hold in the two others: a corridor.
  [[nodiscard]] bool corridor() const { return slides() && held_next > kHeldWell; }

  static constexpr double kHeld = 0.01;  ///< value if one sample in a hundred faced it
  static constexpr double kHeldWell = 0.1;
};

FreeDirection free_direction(const maps::Map& a, const maps::Map& b, const geometry::Rigid3& a_from_b,
                             const std::vector<VerifiedPair>& agreeing);

}  // namespace plumbline::mapping
