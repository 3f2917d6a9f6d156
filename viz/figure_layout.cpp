// SPDX-License-Identifier: BSD-3-Clause
#include "figure_layout.hpp"

#include <algorithm>
#include <cmath>

#include "axis_extent.hpp"

namespace plumbline::viz {
namespace {

constexpr double kTitleHeight = 38.0, kLegendHeight = 30.0, kBelow = 76.0, kLeft = 104.0, kRight = 30.0;
constexpr double kColorBarWidth = 120.0;
constexpr double kFigureTitleHeight = 52.0;

void include_series(const Axes& axes, Extent& x, Extent& y) {
  for (const auto& line : axes.lines) {
    x.include(line.x);
    y.include(line.y);
  }
  for (const auto& scatter : axes.scatter) {
    x.include(scatter.x);
    y.include(scatter.y);
  }
  for (const auto& path : axes.colored_paths) {
    x.include(path.x);
    y.include(path.y);
  }
  for (const auto& box : axes.boxes) y.include(box.values);
}

/// Ranges of the data, before the equal aspect.
void data_ranges(const Axes& axes, PanelLayout& layout) {
  Extent x, y;
  include_series(axes, x, y);
  layout.x = x.padded(axes.lines.empty() ? 0.04 : 0.01);
  layout.y = y.padded(0.06);
  // Quantities that start near zero are read from zero.
  const bool from_zero = !y.empty() && y.low >= 0.0 && y.low < 0.5 * y.high && !axes.equal_aspect;
  if (from_zero) layout.y.first = 0.0;
  if (!axes.boxes.empty()) layout.x = {0.4, static_cast<double>(axes.boxes.size()) + 0.6};
  if (!axes.histograms.empty()) {
    const Bins bins = bin_histograms(axes);
    double most = 1.0;
    for (const auto& counts : bins.counts) {
      for (const double count : counts) most = std::max(most, count);
    }
    layout.x = {bins.low, bins.low + bins.width * axes.histogram_bins};
    layout.y = {0.0, 1.08 * most};
  }
  layout.x = axes.x_range.value_or(layout.x);
  layout.y = axes.y_range.value_or(layout.y);
}

void equalise(PanelLayout& layout) {
  const double x_per_px = (layout.x.second - layout.x.first) / layout.plot.width;
  const double y_per_px = (layout.y.second - layout.y.first) / layout.plot.height;
  if (x_per_px < y_per_px) {
    widen(layout.x, y_per_px / x_per_px);
  } else {
    widen(layout.y, x_per_px / y_per_px);
  }
}

ColorScale color_scale(const Axes& axes) {
  ColorScale scale;
  Extent values;
  for (const auto& path : axes.colored_paths) {
    scale.shown = true;
    if (scale.label.empty()) scale.label = path.value_label;
    if (path.range) {
      values.include(path.range->first);
      values.include(path.range->second);
    } else {
      values.include(path.value);
    }
  }
  const AxisRange range =
      values.empty() || values.low == values.high ? values.padded(0.0) : AxisRange{values.low, values.high};
  scale.low = range.first;
  scale.high = range.second;
  return scale;
}

bool has_legend(const Axes& axes) {
  const auto labelled = [](const auto& series) {
    return std::any_of(series.begin(), series.end(), [](const auto& s) { return !s.label.empty(); });
  };
  return labelled(axes.lines) || labelled(axes.scatter) || labelled(axes.histograms);
}

}  // namespace

BoxSummary summarise_box(const std::vector<double>& values) {
  std::vector<double> sorted;
  std::copy_if(values.begin(), values.end(), std::back_inserter(sorted),
               [](double v) { return std::isfinite(v); });
  BoxSummary box;
  box.count = sorted.size();
  if (sorted.empty()) return box;
  std::sort(sorted.begin(), sorted.end());
  const auto at = [&sorted](double q) {  // linear between order statistics
    const double place = q * static_cast<double>(sorted.size() - 1);
    const auto i = static_cast<std::size_t>(place);
    const double next = sorted[std::min(i + 1, sorted.size() - 1)];
    return sorted[i] + (place - static_cast<double>(i)) * (next - sorted[i]);
  };
  box.first_quartile = at(0.25);
  box.median = at(0.5);
  box.third_quartile = at(0.75);
  const double reach = 1.5 * (box.third_quartile - box.first_quartile);
  box.low_whisker = box.first_quartile;
  box.high_whisker = box.third_quartile;
  for (const double v : sorted) {
    if (v < box.first_quartile - reach || v > box.third_quartile + reach) {
      box.outliers.push_back(v);
    } else {
      box.low_whisker = std::min(box.low_whisker, v);
      box.high_whisker = std::max(box.high_whisker, v);
    }
  }
  return box;
}

Bins bin_histograms(const Axes& axes) {
  Extent extent;
  for (const auto& series : axes.histograms) extent.include(series.values);
  Bins bins;
  AxisRange range = extent.padded(0.0);
  if (!extent.empty() && extent.low >= 0.0 && extent.low < 0.25 * extent.high) range.first = 0.0;
  range = axes.x_range.value_or(range);
  const auto count = static_cast<std::size_t>(std::max(1, axes.histogram_bins));
  bins.low = range.first;
  bins.width = (range.second - range.first) / static_cast<double>(count);
  for (const auto& series : axes.histograms) {
    std::vector<double> counts(count, 0.0);
    for (const double v : series.values) {
      if (!std::isfinite(v) || v < range.first || v > range.second) continue;
      counts[std::min(count - 1, static_cast<std::size_t>((v - bins.low) / bins.width))] += 1.0;
    }
    bins.counts.push_back(std::move(counts));
  }
  return bins;
}

PanelLayout lay_out(const Axes& axes, const Rect& panel) {
  PanelLayout layout;
  layout.panel = panel;
  layout.color_scale = color_scale(axes);
  const double above =
      12.0 + (axes.title.empty() ? 0.0 : kTitleHeight) + (has_legend(axes) ? kLegendHeight : 0.0);
  const double right = kRight + (layout.color_scale.shown ? kColorBarWidth : 0.0);
  layout.plot = {panel.x + kLeft, panel.y + kBelow, std::max(20.0, panel.width - kLeft - right),
                 std::max(20.0, panel.height - kBelow - above)};
  data_ranges(axes, layout);
  if (axes.equal_aspect) equalise(layout);
  const double x_step_px = 110.0;
  const double y_step_px = axes.equal_aspect ? x_step_px : 70.0;
  const auto ticks = [](const AxisRange& range, double length_px, double step_px) {
    return nice_ticks(range.first, range.second, (range.second - range.first) * step_px / length_px);
  };
  layout.x_ticks = ticks(layout.x, layout.plot.width, x_step_px);
  layout.y_ticks = ticks(layout.y, layout.plot.height, y_step_px);
  if (!axes.boxes.empty()) {
    layout.x_ticks = {};
    for (std::size_t i = 0; i < axes.boxes.size(); ++i) {
      layout.x_ticks.values.push_back(static_cast<double>(i) + 1.0);
      layout.x_ticks.labels.push_back(axes.boxes[i].label);
    }
  }
  return layout;
}

std::vector<Rect> panel_rects(const Figure& figure) {
  std::vector<Rect> rects;
  const auto columns = static_cast<std::size_t>(std::max(1, figure.columns));
  const std::size_t rows = (figure.panels.size() + columns - 1) / columns;
  const double top = figure.title.empty() ? 0.0 : kFigureTitleHeight;
  const double width = static_cast<double>(figure.width_px) / static_cast<double>(columns);
  const double height = (figure.height_px - top) / static_cast<double>(std::max<std::size_t>(1, rows));
  for (std::size_t i = 0; i < figure.panels.size(); ++i) {
    const auto column = static_cast<double>(i % columns);
    const auto row = static_cast<double>(i / columns);
    rects.push_back({column * width, figure.height_px - top - (row + 1.0) * height, width, height});
  }
  return rects;
}

}  // namespace plumbline::viz
