// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/geometry/velocity.hpp"

#include <algorithm>
#include <iterator>

namespace plumbline::geometry {

Vector6d velocity_at(const Trajectory& trajectory, double stamp) {
  constexpr double kLongest_s = 0.3;
  const auto later = [](const StampedPose& pose, double s) { return pose.stamp < s; };
  const auto here = std::lower_bound(trajectory.begin(), trajectory.end(), stamp - 1e-4, later);
  if (here == trajectory.end()) return Vector6d::Zero();

  // Central difference; one-sided at both ends of the path.
  const auto before = here == trajectory.begin() ? here : std::prev(here);
  const auto after = std::next(here) == trajectory.end() ? here : std::next(here);
  const double seconds = after->stamp - before->stamp;
  if (!(seconds > 0.0) || seconds > kLongest_s) return Vector6d::Zero();
  return log_se3(after->world_from_camera.inverse() * before->world_from_camera) / seconds;
}

}  // namespace plumbline::geometry
