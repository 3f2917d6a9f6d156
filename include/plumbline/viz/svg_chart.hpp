// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Charts as SVG text: as part of an HTML page, whose style sheet colours them for light and dark ground and
// for paper, or as a file of their own. Words stay words that can be read aloud, searched and copied.
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace plumbline::viz {

using AxisRange = std::pair<double, double>;

/// Points joined in order; a non-finite x or y breaks the line. `kind` names how it is drawn, one of those of
/// svg_chart_style(): "k0" ... "k7" (category_color), "truth", "lost", "loop", "plain". In files also "e0"
/// ... "e4", from little to much (sequential_color).
struct SvgLine {
  std::string label;  ///< in the legend; empty = not listed
  std::string kind = "k0";
  std::vector<double> x, y;
};

struct SvgDots {
  std::string label;
  std::string kind = "k0";
  std::vector<double> x, y;
  double radius_px = 2.5;
  bool ring = false;  ///< open in the middle
};

/// Marks a stretch of x over the whole height: "lost", "unreadable", "tracked".
struct SvgBand {
  std::string kind;
  double from = 0.0;
  double to = 0.0;
};

/// Background picture that covers these ranges of x and y.
struct SvgBackground {
  std::string data_uri;
  AxisRange x, y;
};

struct SvgChart {
  std::string title;             ///< over the chart in files; in pages for screen readers
  std::string x_label, y_label;  ///< with units: "time (s)"
  int width_px = 1000;           ///< of the drawing, which the page may scale
  int height_px = 170;           ///< equal_aspect: found from the data
  bool equal_aspect = false;     ///< one unit of x is as long as one unit of y
  bool y_ticks = true;
  std::optional<AxisRange> x_range, y_range;  ///< none = from the data
  std::optional<SvgBackground> background;
  std::vector<SvgBand> bands;
  std::vector<SvgLine> lines;
  std::vector<SvgDots> dots;
};

/// An HTML figure with legend and SVG, of ASCII and escaped labels. Long curves are thinned to the visible
/// resolution, and peaks are kept. It has no identifiers, so a page can hold any number of charts.
std::string svg_chart(const SvgChart& chart);

/// CSS rules of all charts of a page.
std::string svg_chart_style();

/// Content of a .svg file: charts with title and legend over each, `columns` side by side. It contains its
/// own style, and only uses what every viewer of SVG supports.
std::string svg_document(const std::vector<SvgChart>& charts, std::size_t columns);

/// Text for HTML and XML, in attributes too: markup is escaped; invalid UTF-8 and control characters are
/// replaced by U+FFFD.
std::string markup_text(std::string_view text);

}  // namespace plumbline::viz
