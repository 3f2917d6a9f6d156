// SPDX-License-Identifier: BSD-3-Clause
#include "canvas/color_bar.hpp"

namespace plumbline::viz {

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
