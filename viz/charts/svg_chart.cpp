// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/viz/svg_chart.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "canvas/ticks.hpp"
#include "plumbline/viz/color.hpp"

namespace plumbline::viz {
namespace {

constexpr double kLeft = 64.0, kRight = 14.0, kTop = 8.0, kBelow = 22.0, kLabelBelow = 18.0;
constexpr double kLeast = 260.0, kMost = 760.0;  ///< height of a plot whose axes have one scale, px

/// Range of the finite values.
struct Extent {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
  void include(double v) {
    if (!std::isfinite(v)) return;
    low = std::min(low, v);
    high = std::max(high, v);
  }
  void include(const std::vector<double>& values) {
    for (const double v : values) include(v);
  }
  [[nodiscard]] bool empty() const { return !(low <= high); }
  [[nodiscard]] AxisRange padded(double part) const {
    if (empty()) return {0.0, 1.0};
    const double span = high - low;
    const double pad = span > 0.0 ? part * span : std::max(0.5, 0.1 * std::abs(low));
    return {low - pad, high + pad};
  }
};

/// Scales a range about its middle.
void widen(AxisRange& range, double factor) {
  const double middle = 0.5 * (range.first + range.second);
  const double half = 0.5 * (range.second - range.first) * factor;
  range = {middle - half, middle + half};
}

/// The rectangle inside the axes, and its content.
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

  // Dots count as well as lines.
  for (const SvgDots& dots : chart.dots) {
    x.include(dots.x);
    y.include(dots.y);
  }

  // A background in metres is shown in full.
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

/// Height that gives both axes one scale at this width.
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
    // Ends and extremes draw a crowded pixel column.
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

  /// Places that repeat add nothing to the path.
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

/// Grid, tick labels and axis labels.
std::string axes(const SvgChart& chart, const Plot& plot) {
  // Ticks about 90 and 42 pixels apart.
  const double x_wish = (plot.x.second - plot.x.first) * 90.0 / plot.width;
  const double y_wish = chart.equal_aspect ? x_wish : (plot.y.second - plot.y.first) * 42.0 / plot.height;
  std::string grid, words;
  const auto say = [&words](double x, double y, const char* anchor, const std::string& text) {
    words += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\">{}</text>", x, y, anchor, text);
  };

  // Vertical grid lines.
  for (const Tick& tick : nice_ticks(plot.x.first, plot.x.second, x_wish)) {
    const double x = kLeft + plot.px(tick.value);
    grid += fmt::format("M{:.1f},{:.1f}v{:.1f}", x, kTop, plot.height);
    say(x, kTop + plot.height + 16.0, "middle", tick.label);
  }

  // Horizontal grid lines, unless suppressed.
  for (const Tick& tick :
       chart.y_ticks ? nice_ticks(plot.y.first, plot.y.second, y_wish) : std::vector<Tick>{}) {
    const double y = kTop + plot.py(tick.value);
    grid += fmt::format("M{:.1f},{:.1f}h{:.1f}", kLeft, y, plot.width);
    say(kLeft - 6.0, y + 4.0, "end", tick.label);
  }

  // The label of y reads upwards.
  if (!chart.y_label.empty()) {
    words +=
        fmt::format("<text transform=\"translate(13,{:.1f}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
                    kTop + 0.5 * plot.height, markup_text(chart.y_label));
  }

  if (!chart.x_label.empty()) {
    say(kLeft + 0.5 * plot.width, kTop + plot.height + kBelow + 11.0, "middle", markup_text(chart.x_label));
  }

  return (grid.empty() ? "" : "<path class=\"grid\" d=\"" + grid + "\"/>") + words;
}

/// Everything within the axes, from back to front.
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

  // Periods of time behind the lines.
  for (const SvgBand& band : chart.bands) {
    out += fmt::format("<rect class=\"band-{}\" x=\"{:.1f}\" y=\"0\" width=\"{:.1f}\" height=\"{:.1f}\"/>",
                       band.kind, plot.px(band.from), std::max(1.0, plot.px(band.to) - plot.px(band.from)),
                       plot.height);
  }

  // The pen is lifted at gaps.
  for (const SvgLine& line : chart.lines) {
    Pen pen;
    for (std::size_t i = 0; i < std::min(line.x.size(), line.y.size()); ++i) {
      pen.to(plot.px(line.x[i]), plot.py(line.y[i]));
    }
    out += fmt::format("<path class=\"line {}\" d=\"{}\"/>", line.kind, pen.path());
  }

  // Dots at unknown places are left out.
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

/// Entries of the legend: a sample of 22 x 10 pixels and its label.
std::vector<std::pair<std::string, std::string>> legend_entries(const SvgChart& chart) {
  std::vector<std::pair<std::string, std::string>> entries;
  for (const SvgLine& line : chart.lines) {
    if (line.label.empty()) continue;
    entries.emplace_back(fmt::format("<path class=\"line {}\" d=\"M1,5h20\"/>", line.kind), line.label);
  }
  for (const SvgDots& dots : chart.dots) {
    if (dots.label.empty()) continue;
    entries.emplace_back(fmt::format("<circle class=\"{} {}\" cx=\"11\" cy=\"5\" r=\"{:g}\"/>",
                                     dots.ring ? "ring" : "dot", dots.kind, std::min(4.0, dots.radius_px)),
                         dots.label);
  }
  return entries;
}

/// Legend as an HTML list; empty without entries.
std::string legend(const SvgChart& chart) {
  std::string entries;
  for (const auto& [sample, label] : legend_entries(chart)) {
    entries += "<li><svg width=\"22\" height=\"10\" viewBox=\"0 0 22 10\" aria-hidden=\"true\">" + sample +
               "</svg>" + markup_text(label) + "</li>";
  }
  return entries.empty() ? entries : "<ul class=\"legend\">" + entries + "</ul>";
}

/// A chart without its legend; its upper left corner is at 0, 0.
struct SvgDrawing {
  std::string svg;
  double height = 0.0;
};

/// The chart with its axes, and its height.
SvgDrawing draw(const SvgChart& chart) {
  Plot plot;
  const double below = kBelow + (chart.x_label.empty() ? 0.0 : kLabelBelow);
  plot.width = std::max(50.0, chart.width_px - kLeft - kRight);
  plot.height = std::max(10.0, chart.height_px - kTop - below);
  find_ranges(chart, plot);
  if (chart.equal_aspect) equalise(plot);
  return {fmt::format("{}<svg x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\">{}</svg>"
                      "<rect class=\"frame\" x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\"/>",
                      axes(chart, plot), kLeft, kTop, plot.width, plot.height, marks(chart, plot), kLeft,
                      kTop, plot.width, plot.height),
          kTop + plot.height + below};
}

std::string hex(const Rgb& color) { return fmt::format("#{:02x}{:02x}{:02x}", color.r, color.g, color.b); }

/// The style of svg_chart_style() on white ground, without variables: not every viewer knows them.
std::string document_style() {
  std::string css =
      "text{font:12px sans-serif;fill:#59606b}.title{font-size:14px;fill:#2d3036}"
      ".grid,.frame{fill:none;stroke:#c9ced6}.grid{stroke-width:.7;opacity:.7}"
      ".line{fill:none;stroke-width:1.6;stroke-linejoin:round;stroke-linecap:round}"
      ".ring{fill:#fff;stroke-width:2}.line.truth{stroke-dasharray:5 4}";
  const auto add = [&css](const std::string& kind, const std::string& color) {
    css += fmt::format(".line.{0},.ring.{0}{{stroke:{1}}}.dot.{0}{{fill:{1}}}", kind, color);
  };
  for (std::size_t i = 0; i < 8; ++i) add(fmt::format("k{}", i), hex(category_color(i)));
  for (std::size_t i = 0; i < 5; ++i) {
    add(fmt::format("e{}", i), hex(sequential_color(0.23 * static_cast<double>(i))));
  }
  add("truth", "#868c94");
  add("plain", "#2d3036");
  return css;
}

/// Entries side by side, in as many rows as they need.
SvgDrawing legend_words(const SvgChart& chart) {
  constexpr double kRow = 18.0, kLetter = 6.5;  // px; letters are about so wide
  SvgDrawing words;
  double x = kLeft;
  for (const auto& [sample, label] : legend_entries(chart)) {
    const double width = 40.0 + kLetter * static_cast<double>(label.size());
    if (words.height == 0.0 || x + width > chart.width_px) {
      x = kLeft;
      words.height += kRow;
    }
    words.svg +=
        fmt::format("<g transform=\"translate({:.1f},{:.1f})\">{}<text x=\"27\" y=\"9\">{}</text></g>", x,
                    words.height - kRow, sample, markup_text(label));
    x += width;
  }
  return words;
}

}  // namespace

std::string svg_chart(const SvgChart& chart) {
  const SvgDrawing drawing = draw(chart);
  return fmt::format(
      "<figure class=\"chart\">{}<svg viewBox=\"0 0 {} {:.0f}\" role=\"img\" "
      "aria-label=\"{}\">{}</svg></figure>\n",
      legend(chart), chart.width_px, drawing.height, markup_text(chart.title), drawing.svg);
}

std::string svg_document(const std::vector<SvgChart>& charts, std::size_t columns) {
  constexpr double kTitle = 26.0;
  std::string body;
  double width = 0.0, x = 0.0, y = 0.0, row = 0.0;

  for (std::size_t i = 0; i < charts.size(); ++i) {
    // A new row of charts.
    if (i % columns == 0) {
      x = 0.0;
      y += row;
      row = 0.0;
    }

    // Title above legend above drawing.
    const SvgDrawing words = legend_words(charts[i]);
    const SvgDrawing drawing = draw(charts[i]);
    body += fmt::format(
        "<g transform=\"translate({:.0f},{:.0f})\"><text class=\"title\" x=\"{:.0f}\" y=\"18\">{}</text>"
        "<g transform=\"translate(0,{:.0f})\">{}</g><g transform=\"translate(0,{:.0f})\">{}</g></g>\n",
        x, y, kLeft, markup_text(charts[i].title), kTitle, words.svg, kTitle + words.height, drawing.svg);

    // The next chart is to its right.
    x += charts[i].width_px;
    width = std::max(width, x);
    row = std::max(row, kTitle + words.height + drawing.height);
  }

  // Files without a page carry their style.
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.0f}\" height=\"{1:.0f}\" viewBox=\"0 0 {0:.0f} "
      "{1:.0f}\"><style>{2}</style><rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n{3}</svg>\n",
      width, y + row, document_style(), body);
}

std::string svg_chart_style() {
  // Colours are variables of the page.
  std::string css =
      ".chart{margin:.6em 0}.chart>svg{display:block;width:100%;height:auto}"
      ".chart text{font-size:12px;fill:var(--muted)}.chart .frame{fill:none;stroke:var(--rule)}"
      ".chart .grid{fill:none;stroke:var(--rule);stroke-width:.7;opacity:.7}"
      ".line{fill:none;stroke:var(--k);stroke-width:1.6;stroke-linejoin:round;stroke-linecap:round}"
      ".dot{fill:var(--k)}.ring{fill:var(--ground);stroke:var(--k);stroke-width:2}"
      ".band-lost{fill:#d92d20;opacity:.28}.band-unreadable{fill:#f79009;opacity:.35}"
      ".band-tracked{fill:#12925a;opacity:.55}"
      ".legend{list-style:none;display:flex;flex-wrap:wrap;gap:.1em 1.3em;margin:0 0 .2em;"
      "padding:0 0 0 3.6em;"
      "font-size:.85em;color:var(--muted)}.legend li{display:flex;align-items:center;gap:.45em}"
      ".truth{--k:#868c94;stroke-dasharray:5 4}.lost{--k:#d92d20;stroke-dasharray:3 4}"
      ".loop{--k:#aa4499;stroke-width:1}.plain{--k:#6b7280}\n";

  // Categories, lighter on a dark ground.
  std::string dark;
  for (std::size_t i = 0; i < 8; ++i) {
    const Rgb c = category_color(i);
    css += fmt::format(".k{}{{--k:{}}}", i, hex(c));
    const auto lighter = [](std::uint8_t v) { return static_cast<std::uint8_t>((6 * v + 4 * 255) / 10); };
    dark += fmt::format(".k{}{{--k:{}}}", i, hex({lighter(c.r), lighter(c.g), lighter(c.b)}));
  }

  return css + "\n@media screen and (prefers-color-scheme:dark){.loop{--k:#d48fc8}" + dark + "}\n";
}

}  // namespace plumbline::viz
