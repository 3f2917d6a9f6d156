// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/geometry/trajectory.hpp"

#include <algorithm>
#include <cmath>

namespace plumbline::geometry {

std::optional<Rigid3> pose_at(const Trajectory& trajectory, double stamp, double max_gap_s) {
  const auto after = std::lower_bound(trajectory.begin(), trajectory.end(), stamp,
                                      [](const StampedPose& pose, double s) { return pose.stamp < s; });
  if (after != trajectory.end() && std::abs(after->stamp - stamp) < 1e-6) return after->world_from_camera;
  if (after == trajectory.begin() || after == trajectory.end()) return std::nullopt;
  const StampedPose& a = *(after - 1);
  const StampedPose& b = *after;
  const double gap = b.stamp - a.stamp;
  if (gap > 2.0 * max_gap_s && std::min(stamp - a.stamp, b.stamp - stamp) > max_gap_s) return std::nullopt;
  return interpolate(a.world_from_camera, b.world_from_camera, (stamp - a.stamp) / gap);
}

}  // namespace plumbline::geometry
