// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The terms of the photogrammetric keyframe rule (docs/method/mapping.md; after Azimi, Ahmadabadian,
// Remondino, ISPRS J. 191, 2022): how many landmarks are seen from another side than at the last keyframe,
// and whether these are spread over the image. Plain functions of counts; keyframe_rule.hpp puts them
// together.
#include <array>

#include "plumbline/geometry/rigid3.hpp"

namespace plumbline::mapping {

/// Which ring around a landmark's normal the ray to the camera lies in: <= 10 deg, <= 20, <= 30, beyond: 0-3.
int viewing_zone(double angle_rad);

/// Angle between a surface's normal (unit) and the ray from `point` to `camera_centre`, rad.
double viewing_angle(const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
                     const Eigen::Vector3d& camera_centre);

/// M, A and D of one frame against the last keyframe.
struct ConeCounts {
  int matched = 0;  ///< M: landmarks matched that know their normal
  int all = 0;      ///< A: all points of the frame
  int changed = 0;  ///< D: those of M whose zone has changed since the keyframe
};

struct ConeThreshold {
  double theta = 0.0;     ///< (M_r - M_c) / M_r: matches lost
  double beta = 0.0;      ///< D_c / M_c - D_r / M_r: share of changes gained
  double alpha = 0.0;     ///< D_c / M_c - 0.5
  double initial = 0.0;   ///< 0.5 (M_c D_r / M_r + A_c D_r / A_r)
  double adaptive = 0.0;  ///< (1 + epsilon theta - beta - alpha) initial; D_c must exceed it
};

/// `now`: this frame; `first`: the first frame after the keyframe. Right after a keyframe next to nothing has
/// changed and anything would fire, so D_r counts as 5 % of M_r at least; `scaled`: of M_c, as the camera has
/// turned away from the others, which can change no more. A ratio over nothing counts as 0:
/// without matches nothing has changed, and D_c = 0 exceeds no threshold.
ConeThreshold cone_threshold(const ConeCounts& now, const ConeCounts& first, double epsilon = 1.0,
                             bool scaled = false);

/// Points by cell of a 3 x 3 grid over the image, row by row.
using GridCounts = std::array<int, 9>;

/// Adds a point at `pixel` of an image of this size.
void count_in_grid(const Eigen::Vector2d& pixel, int width, int height, GridCounts& grid);

struct GridBalance {
  /// d max2 / (2 sqrt(2) max1): d the distance in cells between the two fullest ones, of equal ones the
  /// first; 1 is ideal, 0 when fewer than two cells hold anything.
  double ecog = 0.0;
  double offset = 0.0;  ///< of the grid's centre of mass from its middle, cells
};
GridBalance grid_balance(const GridCounts& grid);

/// Condition on the balance: ecog above the offset, as in the method on which the rule is based; below, as
/// the paper prints; none.
enum class Balance { kAbove, kBelow, kOff };
bool balanced(const GridBalance& balance, Balance asked);

}  // namespace plumbline::mapping
