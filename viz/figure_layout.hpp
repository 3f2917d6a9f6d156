// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Where everything of a figure goes: data ranges and rectangles, in pixels from the lower left corner.
#include <vector>

#include "color_bar.hpp"
#include "plumbline/viz/figure.hpp"

namespace plumbline::viz {

struct Rect {
  double x = 0.0, y = 0.0, width = 0.0, height = 0.0;
};

/// Five numbers of a box plot, and what lies outside its whiskers.
struct BoxSummary {
  double low_whisker = 0.0, first_quartile = 0.0, median = 0.0, third_quartile = 0.0, high_whisker = 0.0;
  std::vector<double> outliers;
  std::size_t count = 0;  ///< finite values
};
BoxSummary summarise_box(const std::vector<double>& values);

/// Shared bins of all histograms of a panel.
struct Bins {
  double low = 0.0;
  double width = 1.0;
  std::vector<std::vector<double>> counts;  ///< per series
};
Bins bin_histograms(const Axes& axes);

struct PanelLayout {
  Rect plot;  ///< inside the axes
  Rect panel;
  AxisRange x{0.0, 1.0}, y{0.0, 1.0};
  Ticks x_ticks, y_ticks;
  ColorScale color_scale;
};

/// `axes` within `panel`. With equal_aspect the shorter range is widened.
PanelLayout lay_out(const Axes& axes, const Rect& panel);

/// The panels of a figure, row by row.
std::vector<Rect> panel_rects(const Figure& figure);

}  // namespace plumbline::viz
