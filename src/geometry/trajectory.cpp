// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/geometry/trajectory.hpp"

#include <algorithm>

namespace plumbline::geometry {

std::optional<Rigid3> pose_at(const Trajectory& trajectory, double stamp, double max_gap_s) {
  const auto after = std::lower_bound(trajectory.begin(), trajectory.end(), stamp,
                                      [](const StampedPose& pose, double s) { return pose.stamp < s; });

  // Seconds since 1970 as a double are accurate to 2e-7, so smaller differences are ignored on both sides.
  constexpr double kSame = 1e-6;
  if (after != trajectory.end() && after->stamp - stamp < kSame) return after->world_from_camera;
  if (after != trajectory.begin() && stamp - (after - 1)->stamp < kSame)
    return (after - 1)->world_from_camera;
  if (after == trajectory.begin() || after == trajectory.end()) return std::nullopt;

  const StampedPose& a = *(after - 1);
  const StampedPose& b = *after;
  const double gap = b.stamp - a.stamp;
  if (gap > 2.0 * max_gap_s && std::min(stamp - a.stamp, b.stamp - stamp) > max_gap_s) return std::nullopt;
  return interpolate(a.world_from_camera, b.world_from_camera, (stamp - a.stamp) / gap);
}

}  // namespace plumbline::geometry
