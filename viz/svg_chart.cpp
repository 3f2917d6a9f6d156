// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/viz/svg_chart.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "axis_extent.hpp"
#include "ticks.hpp"

namespace plumbline::viz {
namespace {

constexpr double kLeft = 64.0, kRight = 14.0, kTop = 8.0, kBelow = 22.0, kLabelBelow = 18.0;
constexpr double kLeast = 260.0, kMost = 760.0;  ///< height of a plot whose axes have one scale, px

/// The rectangle inside the axes, and what it shows.
struct Plot {
  double width = 1.0;
  double height = 1.0;
  AxisRange x{0.0, 1.0}, y{0.0, 1.0};
  [[nodiscard]] double px(double v) const { return width * (v - x.first) / (x.second - x.first); }
  [[nodiscard]] double py(double v) const { return height * (y.second - v) / (y.second - y.first); }
};

void find_ranges(const SvgChart& chart, Plot& plot) {
  Extent x, y;
  for (const SvgLine& line : chart.lines) {
    x.include(line.x);
    y.include(line.y);
  }
  for (const SvgDots& dots : chart.dots) {
    x.include(dots.x);
    y.include(dots.y);
  }
  if (chart.equal_aspect && chart.background) {
    x.include({chart.background->x.first, chart.background->x.second});
    y.include({chart.background->y.first, chart.background->y.second});
  }
  plot.x = x.padded(chart.equal_aspect ? 0.03 : 0.0);
  plot.y = y.padded(chart.equal_aspect ? 0.03 : 0.06);
  // Quantities that start near zero are read from zero.
  if (!chart.equal_aspect && y.low >= 0.0 && y.low < 0.5 * y.high) plot.y.first = 0.0;
  plot.x = chart.x_range.value_or(plot.x);
  plot.y = chart.y_range.value_or(plot.y);
}

/// The height that the data want at this width, and one scale for both axes.
void equalise(Plot& plot) {
  const double x_span = plot.x.second - plot.x.first;
  const double y_span = plot.y.second - plot.y.first;
  plot.height = std::clamp(plot.width * y_span / x_span, kLeast, kMost);
  const double ratio = (y_span / plot.height) / (x_span / plot.width);
  if (ratio > 1.0) {
    widen(plot.x, ratio);
  } else {
    widen(plot.y, 1.0 / ratio);
  }
}

/// Draws a polyline in pixels, thinned: of what falls into one column, first, least, greatest and last.
class Pen {
 public:
  void to(double x, double y) {
    if (!std::isfinite(x) || !std::isfinite(y)) {
      end_column();
      down_ = false;
      return;
    }
    const double column = std::floor(2.0 * x);
    if (!column_.empty() && column != at_) end_column();
    at_ = column;
    column_.push_back({x, y});
  }
  std::string path() {
    end_column();
    return std::move(path_);
  }

 private:
  struct Place {
    double x, y;
  };
  void end_column() {
    if (column_.size() <= 4) {
      for (const Place& p : column_) draw(p);
    } else {
      const auto by_y = [](const Place& a, const Place& b) { return a.y < b.y; };
      auto [least, most] = std::minmax_element(column_.begin(), column_.end(), by_y);
      if (most < least) std::swap(least, most);
      for (const Place& p : {column_.front(), *least, *most, column_.back()}) draw(p);
    }
    column_.clear();
  }
  void draw(const Place& p) {
    std::string place = fmt::format("{:.1f},{:.1f}", p.x, p.y);
    if (down_ && place == last_) return;
    path_ += down_ ? (just_down_ ? "L" : " ") : "M";
    path_ += place;
    just_down_ = !down_;
    down_ = true;
    last_ = std::move(place);
  }

  std::vector<Place> column_;
  double at_ = 0.0;
  bool down_ = false;
  bool just_down_ = false;
  std::string last_;
  std::string path_;
};

std::string axes(const SvgChart& chart, const Plot& plot) {
  const double x_wish = (plot.x.second - plot.x.first) * 90.0 / plot.width;
  const double y_wish = chart.equal_aspect ? x_wish : (plot.y.second - plot.y.first) * 42.0 / plot.height;
  std::string grid, words;
  const Ticks across = nice_ticks(plot.x.first, plot.x.second, x_wish);
  for (std::size_t i = 0; i < across.values.size(); ++i) {
    const double x = kLeft + plot.px(across.values[i]);
    grid += fmt::format("M{:.1f},{:.1f}v{:.1f}", x, kTop, plot.height);
    words += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>", x,
                         kTop + plot.height + 16.0, across.labels[i]);
  }
  const Ticks up = chart.y_ticks ? nice_ticks(plot.y.first, plot.y.second, y_wish) : Ticks{};
  for (std::size_t i = 0; i < up.values.size(); ++i) {
    const double y = kTop + plot.py(up.values[i]);
    grid += fmt::format("M{:.1f},{:.1f}h{:.1f}", kLeft, y, plot.width);
    words += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"end\">{}</text>", kLeft - 6.0,
                         y + 4.0, up.labels[i]);
  }
  if (!chart.y_label.empty()) {
    words +=
        fmt::format("<text transform=\"translate(13,{:.1f}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
                    kTop + 0.5 * plot.height, markup_text(chart.y_label));
  }
  if (!chart.x_label.empty()) {
    words +=
        fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>",
                    kLeft + 0.5 * plot.width, kTop + plot.height + kBelow + 11.0, markup_text(chart.x_label));
  }
  return (grid.empty() ? "" : "<path class=\"grid\" d=\"" + grid + "\"/>") + words;
}

std::string marks(const SvgChart& chart, const Plot& plot) {
  std::string out;
  if (chart.background) {
    const SvgBackground& b = *chart.background;
    out += fmt::format(
        "<image x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" preserveAspectRatio=\"none\" "
        "href=\"{}\"/>",
        plot.px(b.x.first), plot.py(b.y.second), plot.px(b.x.second) - plot.px(b.x.first),
        plot.py(b.y.first) - plot.py(b.y.second), b.data_uri);
  }
  for (const SvgBand& band : chart.bands) {
    out += fmt::format("<rect class=\"band-{}\" x=\"{:.1f}\" y=\"0\" width=\"{:.1f}\" height=\"{:.1f}\"/>",
                       band.kind, plot.px(band.from), std::max(1.0, plot.px(band.to) - plot.px(band.from)),
                       plot.height);
  }
  for (const SvgLine& line : chart.lines) {
    Pen pen;
    for (std::size_t i = 0; i < std::min(line.x.size(), line.y.size()); ++i) {
      pen.to(plot.px(line.x[i]), plot.py(line.y[i]));
    }
    out += fmt::format("<path class=\"line {}\" d=\"{}\"/>", line.kind, pen.path());
  }
  for (const SvgDots& dots : chart.dots) {
    for (std::size_t i = 0; i < std::min(dots.x.size(), dots.y.size()); ++i) {
      if (!std::isfinite(dots.x[i]) || !std::isfinite(dots.y[i])) continue;
      out += fmt::format("<circle class=\"{} {}\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:g}\"/>",
                         dots.ring ? "ring" : "dot", dots.kind, plot.px(dots.x[i]), plot.py(dots.y[i]),
                         dots.radius_px);
    }
  }
  return out;
}

std::string legend(const SvgChart& chart) {
  std::string entries;
  const auto add = [&](const std::string& label, const std::string& sample) {
    if (label.empty()) return;
    entries += "<li><svg width=\"22\" height=\"10\" viewBox=\"0 0 22 10\" aria-hidden=\"true\">" + sample +
               "</svg>" + markup_text(label) + "</li>";
  };
  for (const SvgLine& line : chart.lines) {
    add(line.label, fmt::format("<path class=\"line {}\" d=\"M1,5h20\"/>", line.kind));
  }
  for (const SvgDots& dots : chart.dots) {
    add(dots.label, fmt::format("<circle class=\"{} {}\" cx=\"11\" cy=\"5\" r=\"{:g}\"/>",
                                dots.ring ? "ring" : "dot", dots.kind, std::min(4.0, dots.radius_px)));
  }
  return entries.empty() ? entries : "<ul class=\"legend\">" + entries + "</ul>";
}

}  // namespace

std::string svg_chart(const SvgChart& chart) {
  Plot plot;
  const double below = kBelow + (chart.x_label.empty() ? 0.0 : kLabelBelow);
  plot.width = std::max(50.0, chart.width_px - kLeft - kRight);
  plot.height = std::max(10.0, chart.height_px - kTop - below);
  find_ranges(chart, plot);
  if (chart.equal_aspect) equalise(plot);
  return fmt::format(
      "<figure class=\"chart\">{}<svg viewBox=\"0 0 {} {:.0f}\" role=\"img\" aria-label=\"{}\">{}"
      "<svg x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\">{}</svg>"
      "<rect class=\"frame\" x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\"/></svg></figure>\n",
      legend(chart), chart.width_px, kTop + plot.height + below, markup_text(chart.title), axes(chart, plot),
      kLeft, kTop, plot.width, plot.height, marks(chart, plot), kLeft, kTop, plot.width, plot.height);
}

std::string svg_chart_style() {
  std::string css =
      ".chart{margin:.6em 0}.chart>svg{display:block;width:100%;height:auto}"
      ".chart text{font-size:12px;fill:var(--muted)}.chart .frame{fill:none;stroke:var(--rule)}"
      ".chart .grid{fill:none;stroke:var(--rule);stroke-width:.7;opacity:.7}"
      ".line{fill:none;stroke:var(--k);stroke-width:1.6;stroke-linejoin:round;stroke-linecap:round}"
      ".dot{fill:var(--k)}.ring{fill:var(--ground);stroke:var(--k);stroke-width:2}"
      ".band-lost{fill:#d92d20;opacity:.28}.band-unreadable{fill:#f79009;opacity:.35}"
      ".band-tracked{fill:#12925a;opacity:.55}"
      ".legend{list-style:none;display:flex;flex-wrap:wrap;gap:.1em 1.3em;margin:0 0 .2em;padding:0 0 0 "
      "3.6em;"
      "font-size:.85em;color:var(--muted)}.legend li{display:flex;align-items:center;gap:.45em}"
      ".truth{--k:#868c94;stroke-dasharray:5 4}.lost{--k:#d92d20;stroke-dasharray:3 4}"
      ".loop{--k:#aa4499;stroke-width:1}.plain{--k:#6b7280}\n";
  std::string dark;
  for (std::size_t i = 0; i < 8; ++i) {
    const Rgb c = category_color(i);
    css += fmt::format(".k{}{{--k:#{:02x}{:02x}{:02x}}}", i, c.r, c.g, c.b);
    const auto lighter = [](std::uint8_t v) { return (6 * v + 4 * 255) / 10; };
    dark += fmt::format(".k{}{{--k:#{:02x}{:02x}{:02x}}}", i, lighter(c.r), lighter(c.g), lighter(c.b));
  }
  return css + "\n@media screen and (prefers-color-scheme:dark){.loop{--k:#d48fc8}" + dark + "}\n";
}

}  // namespace plumbline::viz
