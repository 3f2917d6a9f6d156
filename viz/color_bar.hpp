// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Ticks at round numbers, and the colour bar that snapshots and charts share.
#include <Eigen/Core>
#include <string>
#include <vector>

#include "painter.hpp"

namespace plumbline::viz {

/// The greatest of 1, 2, 5 x 10^n that is at most `limit` (> 0).
double nice_number_below(double limit);

struct Ticks {
  std::vector<double> values;
  std::vector<std::string> labels;  ///< with as many decimals as the step needs
};
/// Ticks in [low, high] at multiples of 1, 2 or 5 x 10^n, about `wish` apart.
Ticks nice_ticks(double low, double high, double wish);

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
