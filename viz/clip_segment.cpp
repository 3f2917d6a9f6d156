// SPDX-License-Identifier: BSD-3-Clause
#include "clip_segment.hpp"

#include <algorithm>

namespace plumbline::viz {

bool clip_segment(Eigen::Vector2d& a, Eigen::Vector2d& b, const Eigen::Vector2d& low,
                  const Eigen::Vector2d& high) {
  const Eigen::Vector2d start = a;
  const Eigen::Vector2d step = b - a;
  double enter = 0.0;
  double leave = 1.0;
  for (int axis = 0; axis < 2; ++axis) {
    if (step[axis] == 0.0) {
      if (start[axis] < low[axis] || start[axis] > high[axis]) return false;
      continue;
    }
    const double to_low = (low[axis] - start[axis]) / step[axis];
    const double to_high = (high[axis] - start[axis]) / step[axis];
    enter = std::max(enter, std::min(to_low, to_high));
    leave = std::min(leave, std::max(to_low, to_high));
  }
  if (enter > leave) return false;
  if (leave < 1.0) b = start + leave * step;
  if (enter > 0.0) a = start + enter * step;
  return true;
}

}  // namespace plumbline::viz
