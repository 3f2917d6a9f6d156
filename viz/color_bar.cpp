// SPDX-License-Identifier: BSD-3-Clause
#include "color_bar.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace plumbline::viz {

double nice_number_below(double limit) {
  const double decade = std::pow(10.0, std::floor(std::log10(limit)));
  for (const double factor : {5.0, 2.0}) {
    if (factor * decade <= limit * (1.0 + 1e-9)) return factor * decade;
  }
  return decade;
}

Ticks nice_ticks(double low, double high, double wish) {
  Ticks ticks;
  const double span = high - low;
  if (!(span > 0.0) || !std::isfinite(span) || !(wish > 0.0)) return ticks;
  // The step nearest to the wish rather than the one below it, which may give twice as many.
  const double step = nice_number_below(1.5 * wish);
  const int decimals = std::clamp(static_cast<int>(std::ceil(-std::log10(step) - 1e-9)), 0, 12);
  const bool scientific = step >= 1e6 || step < 1e-6;
  for (double k = std::ceil(low / step - 1e-6); k * step <= high + 1e-6 * span; k += 1.0) {
    const double value = k == 0.0 ? 0.0 : k * step;  // no "-0"
    ticks.values.push_back(value);
    ticks.labels.push_back(scientific ? fmt::format("{:.3g}", value)
                                      : fmt::format("{:.{}f}", value, decimals));
  }
  return ticks;
}

void draw_color_bar(Painter& painter, const ColorScale& scale, const Eigen::Vector2d& corner, double height,
                    double text_px) {
  constexpr int kSteps = 128;
  constexpr Rgb kInk{45, 48, 54};
  const double s = painter.scale();
  const double width = text_px * s;
  const double step = height / kSteps;
  for (int i = 0; i < kSteps; ++i) {
    const bool last = i + 1 == kSteps;  // overlap, so that no seam shows between the steps
    painter.rectangle(corner + Eigen::Vector2d(0.0, i * step), {width, last ? step : 2.0 * step},
                      sequential_color((i + 0.5) / kSteps));
  }
  const double span = scale.high - scale.low;
  const Ticks ticks = nice_ticks(scale.low, scale.high, span / 5.0);
  for (std::size_t i = 0; i < ticks.values.size(); ++i) {
    const double y = corner.y() + height * (ticks.values[i] - scale.low) / span;
    painter.polyline({{corner.x() + width, y}, {corner.x() + width + 6.0 * s, y}}, kInk, 1.5);
    painter.text({corner.x() + width + 11.0 * s, y}, ticks.labels[i], 0.88 * text_px, kInk);
  }
}

}  // namespace plumbline::viz
