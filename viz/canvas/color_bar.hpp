// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The colour bar of snapshots.
#include <Eigen/Core>
#include <string>

#include "canvas/painter.hpp"
#include "canvas/ticks.hpp"

namespace plumbline::viz {

/// What a colour bar explains.
struct ColorScale {
  bool shown = false;
  double low = 0.0;
  double high = 1.0;
  std::string label;
};

/// A vertical bar from `corner` (lower left) upwards, ticks to its right, label above.
void draw_color_bar(Painter& painter, const ColorScale& scale, const Eigen::Vector2d& corner, double height,
                    double text_px);

}  // namespace plumbline::viz
