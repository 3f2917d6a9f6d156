// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The marks inside the axes of a panel.
#include <vector>

#include "figure_layout.hpp"

namespace plumbline::viz {

/// Draws in data coordinates; what lies outside the axes is cut off.
class SeriesPainter {
 public:
  SeriesPainter(Painter& painter, const PanelLayout& layout) : painter_(painter), layout_(layout) {}

  using Values = std::vector<double>;
  /// A non-finite coordinate breaks the line.
  void line(const Values& x, const Values& y, const Rgb& color, double width_px, bool dashed = false);
  void dots(const Values& x, const Values& y, const Rgb& color, double size_px);
  void colored(const ColoredPath& path);
  void box(const BoxSeries& series, double at);
  void histogram(const Values& counts, const Bins& bins, const Rgb& color);
  /// Data to pixels.
  [[nodiscard]] Eigen::Vector2d at(double x, double y) const;

 private:
  void filled(double x0, double x1, double y0, double y1, const Rgb& color);

  Painter& painter_;
  const PanelLayout& layout_;
};

}  // namespace plumbline::viz
