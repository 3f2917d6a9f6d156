// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/maps/frame_pose.hpp"
#include "plumbline/maps/map.hpp"

namespace plumbline::adjust {

/// p_new = scale * rotation * p + translation, in the frame of results.
struct Similarity {
  double scale = 1.0;
  geometry::Rigid3 motion;
  Eigen::Vector3d operator*(const Eigen::Vector3d& p) const { return motion * (scale * p); }
};
/// `second` after `first`.
Similarity operator*(const Similarity& second, const Similarity& first);

/// Moves and scales everything in a map, what its keyframes and frames measured too.
void apply(const Similarity& similarity, const geometry::Rigid3& output_from_map, maps::Map& map,
           std::vector<maps::FramePose>& frames);

}  // namespace plumbline::adjust
