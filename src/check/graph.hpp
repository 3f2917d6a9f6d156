// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The corrections of all pairs put together.
#include <vector>

#include "pair.hpp"
#include "plumbline/geometry/pose_samples.hpp"

namespace plumbline::check {

/// The correction of a pair; `first` and `second` are numbers of anchors.
struct PairLink {
  std::size_t first = 0;
  std::size_t second = 0;
  Correction correction;
};

struct GraphAnchor {
  geometry::Rigid3 world_from_camera;
  std::size_t way = 0;
  double stamp = 0.0;
};

struct GraphReport {
  double rms_m = 0.0;           ///< of the anchors' shifts, after a rigid alignment
  std::vector<double> shift_m;  ///< by anchor
  std::vector<double> weight;   ///< by link, 1: it agrees with the others, 0: it is refused
  /// By anchor, motions (t, w) in the world about its origin that do not move the path as a whole: the one
  /// that was found, and draws from the covariance of all.
  std::vector<geometry::Vector6d> found;
  std::vector<geometry::PoseSamples> draws;
  double draws_rms_m = 0.0;  ///< of the anchors' shifts in these
};

/// Motions of the anchors about the world's origin, less that of the path as a whole.
std::vector<geometry::Vector6d> without_whole(const std::vector<GraphAnchor>& anchors,
                                              std::vector<geometry::Vector6d> motions);

/// Anchors are by way, in order. Fewer than three, or no link: an empty report.
GraphReport put_together(const std::vector<GraphAnchor>& anchors, const std::vector<PairLink>& links);

}  // namespace plumbline::check
