// SPDX-License-Identifier: BSD-3-Clause
#include "chart.hpp"

#include <algorithm>
#include <string>

#include "series.hpp"

namespace plumbline::viz {
namespace {

constexpr Rgb kInk{45, 48, 54};
constexpr Rgb kAxis{120, 124, 130};
constexpr Rgb kGrid{228, 230, 233};
constexpr double kTickText = 17.0, kLabelText = 19.0, kTitleText = 21.0;  // pixels

struct LegendEntry {
  std::string label;
  Rgb color;
  bool line = false;
  bool dashed = false;
};

std::vector<LegendEntry> legend_entries(const Axes& axes) {
  std::vector<LegendEntry> entries;
  for (const auto& s : axes.lines) entries.push_back({s.label, s.color, true, s.dashed});
  for (const auto& s : axes.scatter) entries.push_back({s.label, s.color});
  for (const auto& s : axes.histograms) entries.push_back({s.label, s.color});
  entries.erase(std::remove_if(entries.begin(), entries.end(), [](const auto& e) { return e.label.empty(); }),
                entries.end());
  return entries;
}

void draw_title_and_legend(Painter& painter, const Axes& axes, const PanelLayout& layout) {
  const double s = painter.scale();
  double y = (layout.panel.y + layout.panel.height - 12.0) * s;
  double x = layout.plot.x * s;
  if (!axes.title.empty()) {
    painter.text({x, y - 16.0 * s}, axes.title, kTitleText, kInk, Anchor::kLeft, true);
    y -= 34.0 * s;
  }
  y -= 16.0 * s;
  for (const auto& entry : legend_entries(axes)) {
    if (entry.line && entry.dashed) {
      painter.dashed_line({{x, y}, {x + 28.0 * s, y}}, entry.color, 2.5);
    } else if (entry.line) {
      painter.polyline({{x, y}, {x + 28.0 * s, y}}, entry.color, 3.0);
    } else {
      painter.disc({x + 14.0 * s, y}, 6.0, entry.color);
    }
    painter.text({x + 36.0 * s, y}, entry.label, kTickText, kInk);
    x += 60.0 * s + painter.text_width(entry.label, kTickText);
  }
}

void draw_grid(Painter& painter, const SeriesPainter& series, const PanelLayout& layout) {
  for (const double x : layout.x_ticks.values) {
    painter.polyline({series.at(x, layout.y.first), series.at(x, layout.y.second)}, kGrid, 1.0);
  }
  for (const double y : layout.y_ticks.values) {
    painter.polyline({series.at(layout.x.first, y), series.at(layout.x.second, y)}, kGrid, 1.0);
  }
}

void draw_series(SeriesPainter& series, const Axes& axes) {
  if (!axes.histograms.empty()) {
    const Bins bins = bin_histograms(axes);
    for (std::size_t i = 0; i < bins.counts.size(); ++i) {
      series.histogram(bins.counts[i], bins, axes.histograms[i].color);
    }
  }
  for (std::size_t i = 0; i < axes.boxes.size(); ++i) series.box(axes.boxes[i], static_cast<double>(i) + 1.0);
  for (const auto& s : axes.lines) series.line(s.x, s.y, s.color, s.width_px, s.dashed);
  for (const auto& s : axes.colored_paths) series.colored(s);
  for (const auto& s : axes.scatter) series.dots(s.x, s.y, s.color, s.size_px);
}

void draw_axes(Painter& painter, const SeriesPainter& series, const Axes& axes, const PanelLayout& layout) {
  const double s = painter.scale();
  const Eigen::Vector2d corner = series.at(layout.x.first, layout.y.first);
  painter.polyline(
      {series.at(layout.x.first, layout.y.second), corner, series.at(layout.x.second, layout.y.first)}, kAxis,
      1.4);
  for (std::size_t i = 0; i < layout.x_ticks.values.size(); ++i) {
    const Eigen::Vector2d at = series.at(layout.x_ticks.values[i], layout.y.first);
    painter.polyline({at, at - Eigen::Vector2d(0.0, 5.0 * s)}, kAxis, 1.4);
    painter.text(at - Eigen::Vector2d(0.0, 18.0 * s), layout.x_ticks.labels[i], kTickText, kInk,
                 Anchor::kCentre);
  }
  for (std::size_t i = 0; i < layout.y_ticks.values.size(); ++i) {
    const Eigen::Vector2d at = series.at(layout.x.first, layout.y_ticks.values[i]);
    painter.polyline({at, at - Eigen::Vector2d(5.0 * s, 0.0)}, kAxis, 1.4);
    painter.text(at - Eigen::Vector2d(10.0 * s, 0.0), layout.y_ticks.labels[i], kTickText, kInk,
                 Anchor::kRight);
  }
  const Rect& plot = layout.plot;
  painter.text({(plot.x + 0.5 * plot.width) * s, (plot.y - 50.0) * s}, axes.x_label, kLabelText, kInk,
               Anchor::kCentre);
  painter.vertical_text({(plot.x - 76.0) * s, (plot.y + 0.5 * plot.height) * s}, axes.y_label, kLabelText,
                        kInk);
}

}  // namespace

void draw_panel(Painter& painter, const Axes& axes, const PanelLayout& layout) {
  SeriesPainter series(painter, layout);
  draw_title_and_legend(painter, axes, layout);
  draw_grid(painter, series, layout);
  draw_series(series, axes);
  draw_axes(painter, series, axes, layout);
  if (!layout.color_scale.shown) return;
  const double s = painter.scale();
  const Eigen::Vector2d corner((layout.plot.x + layout.plot.width + 24.0) * s, layout.plot.y * s);
  const double height = layout.plot.height * s;
  draw_color_bar(painter, layout.color_scale, corner, height, kLabelText);
  painter.text(corner + Eigen::Vector2d(-8.0 * s, height + 20.0 * s), layout.color_scale.label, kTickText,
               kInk);
}

}  // namespace plumbline::viz
