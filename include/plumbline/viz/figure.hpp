// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Charts as plain data, drawn by VTK's 2D painter off-screen. One Figure gives the same drawing as PNG and
// SVG.
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/viz/color.hpp"

namespace plumbline::viz {

using AxisRange = std::pair<double, double>;

/// Points joined in order; a non-finite x or y breaks the line.
struct LineSeries {
  std::string label;  ///< in the legend; empty = not listed
  std::vector<double> x, y;
  Rgb color = category_color(0);
  double width_px = 2.0;
  bool dashed = false;
};

struct ScatterSeries {
  std::string label;
  std::vector<double> x, y;
  Rgb color = category_color(0);
  double size_px = 5.0;
};

/// A line whose colour follows a value, with a colour bar beside the panel (one per panel).
struct ColoredPath {
  std::vector<double> x, y, value;
  std::string value_label;         ///< with its unit
  std::optional<AxisRange> range;  ///< none = least to greatest value
  double width_px = 3.0;
};

/// Median, quartiles, whiskers to the last value within 1.5 quartile distances, outliers as dots.
/// Boxes of a panel stand side by side on their own axis.
struct BoxSeries {
  std::string label;  ///< under the box
  std::vector<double> values;
  Rgb color = category_color(0);
};

/// Histograms of a panel share their bins.
struct HistogramSeries {
  std::string label;
  std::vector<double> values;
  Rgb color = category_color(0);
};

/// One panel. Boxes and histograms each need a panel of their own kind; the others mix.
struct Axes {
  std::string title;
  std::string x_label, y_label;  ///< with units: "time (s)"
  std::vector<LineSeries> lines;
  std::vector<ScatterSeries> scatter;
  std::vector<ColoredPath> colored_paths;
  std::vector<BoxSeries> boxes;
  std::vector<HistogramSeries> histograms;
  int histogram_bins = 30;
  bool equal_aspect = false;                  ///< one unit of x is as long as one unit of y
  std::optional<AxisRange> x_range, y_range;  ///< none = from the data
};

struct Figure {
  std::string title;
  int columns = 1;  ///< panels are laid out row by row
  int width_px = 1600;
  int height_px = 1000;
  std::vector<Axes> panels;
};

/// Errors: kUsage (size, x and y of different lengths), kOutput (the message names the file).
core::Result<void> write_figure_png(const Figure& figure, const std::filesystem::path& file);
core::Result<void> write_figure_svg(const Figure& figure, const std::filesystem::path& file);

}  // namespace plumbline::viz
