// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

namespace plumbline::viz {

/// The part of segment a-b inside the rectangle [low, high] (Liang and Barsky 1984); false when none is.
bool clip_segment(Eigen::Vector2d& a, Eigen::Vector2d& b, const Eigen::Vector2d& low,
                  const Eigen::Vector2d& high);

}  // namespace plumbline::viz
