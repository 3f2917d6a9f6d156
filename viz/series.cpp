// SPDX-License-Identifier: BSD-3-Clause
#include "series.hpp"

#include <algorithm>
#include <cmath>

#include "clip_segment.hpp"

namespace plumbline::viz {

Eigen::Vector2d SeriesPainter::at(double x, double y) const {
  const Rect& plot = layout_.plot;
  const double u = (x - layout_.x.first) / (layout_.x.second - layout_.x.first);
  const double v = (y - layout_.y.first) / (layout_.y.second - layout_.y.first);
  return painter_.scale() * Eigen::Vector2d(plot.x + u * plot.width, plot.y + v * plot.height);
}

void SeriesPainter::line(const Values& x, const Values& y, const Rgb& color, double width_px, bool dashed) {
  const Eigen::Vector2d low = at(layout_.x.first, layout_.y.first);
  const Eigen::Vector2d high = at(layout_.x.second, layout_.y.second);
  std::vector<Eigen::Vector2d> piece;
  const auto finish = [&] {
    if (dashed) {
      painter_.dashed_line(piece, color, width_px);
    } else {
      painter_.polyline(piece, color, width_px);
    }
    piece.clear();
  };
  for (std::size_t i = 1; i < x.size(); ++i) {
    Eigen::Vector2d a = at(x[i - 1], y[i - 1]);
    Eigen::Vector2d b = at(x[i], y[i]);
    if (!a.allFinite() || !b.allFinite() || !clip_segment(a, b, low, high)) {
      finish();
      continue;
    }
    if (!piece.empty() && piece.back() != a) finish();
    if (piece.empty()) piece.push_back(a);
    piece.push_back(b);
  }
  finish();
}

void SeriesPainter::dots(const Values& x, const Values& y, const Rgb& color, double size_px) {
  for (std::size_t i = 0; i < x.size(); ++i) {
    const bool inside = x[i] >= layout_.x.first && x[i] <= layout_.x.second && y[i] >= layout_.y.first &&
                        y[i] <= layout_.y.second;  // false for NaN
    if (inside) painter_.disc(at(x[i], y[i]), 0.5 * size_px, color);
  }
}

void SeriesPainter::colored(const ColoredPath& path) {
  const ColorScale& scale = layout_.color_scale;
  for (std::size_t i = 1; i < path.x.size(); ++i) {
    const double value = 0.5 * (path.value[i - 1] + path.value[i]);
    const Rgb color = sequential_color((value - scale.low) / (scale.high - scale.low));
    line({path.x[i - 1], path.x[i]}, {path.y[i - 1], path.y[i]}, color, path.width_px);
    dots({path.x[i]}, {path.y[i]}, color, path.width_px);  // a round joint
  }
}

void SeriesPainter::filled(double x0, double x1, double y0, double y1, const Rgb& color) {
  const Eigen::Vector2d low = at(std::clamp(x0, layout_.x.first, layout_.x.second),
                                 std::clamp(y0, layout_.y.first, layout_.y.second));
  const Eigen::Vector2d high = at(std::clamp(x1, layout_.x.first, layout_.x.second),
                                  std::clamp(y1, layout_.y.first, layout_.y.second));
  if ((high - low).minCoeff() > 0.0) painter_.rectangle(low, high - low, color, 0.3);
}

void SeriesPainter::box(const BoxSeries& series, double x) {
  const BoxSummary box = summarise_box(series.values);
  if (box.count == 0) return;
  constexpr double kHalf = 0.26, kCap = 0.12, kWidth = 2.0;
  const double left = x - kHalf, right = x + kHalf;
  filled(left, right, box.first_quartile, box.third_quartile, series.color);
  line({left, right, right, left, left},
       {box.first_quartile, box.first_quartile, box.third_quartile, box.third_quartile, box.first_quartile},
       series.color, kWidth);
  line({x, x}, {box.low_whisker, box.first_quartile}, series.color, kWidth);
  line({x, x}, {box.third_quartile, box.high_whisker}, series.color, kWidth);
  for (const double end : {box.low_whisker, box.high_whisker}) {
    line({x - kCap, x + kCap}, {end, end}, series.color, kWidth);
  }
  line({left, right}, {box.median, box.median}, series.color, 2.0 * kWidth);
  dots(Values(box.outliers.size(), x), box.outliers, series.color, 5.0);
}

void SeriesPainter::histogram(const Values& counts, const Bins& bins, const Rgb& color) {
  Values x, y;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const double left = bins.low + bins.width * static_cast<double>(i);
    filled(left, left + bins.width, 0.0, counts[i], color);
    x.insert(x.end(), {left, left + bins.width});
    y.insert(y.end(), {counts[i], counts[i]});
  }
  line(x, y, color, 2.0);
}

}  // namespace plumbline::viz
