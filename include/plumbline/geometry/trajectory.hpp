// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Stamped camera poses.
#include <optional>
#include <vector>

#include "plumbline/geometry/rigid3.hpp"

namespace plumbline::geometry {

struct StampedPose {
  double stamp = 0.0;  ///< seconds
  Rigid3 world_from_camera;
};

/// Sorted by stamp.
using Trajectory = std::vector<StampedPose>;

/// Pose at `stamp`, interpolated; none outside the trajectory or inside a gap longer than 2*max_gap_s
/// when the nearest pose is further than max_gap_s.
std::optional<Rigid3> pose_at(const Trajectory& trajectory, double stamp, double max_gap_s = 0.02);

}  // namespace plumbline::geometry
