// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/viz/color.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace plumbline::viz {

Rgb category_color(std::size_t index) {
  static constexpr std::array<Rgb, 8> kColors{{{0, 114, 178},
                                               {213, 94, 0},
                                               {0, 158, 115},
                                               {170, 68, 153},
                                               {230, 159, 0},
                                               {86, 180, 233},
                                               {136, 34, 85},
                                               {90, 90, 90}}};
  return kColors[index % kColors.size()];
}

Rgb sequential_color(double s) {
  // viridis (Smith and van der Walt, CC0) at eighths.
  static constexpr std::array<Rgb, 9> kStops{{{68, 1, 84},
                                              {71, 44, 122},
                                              {59, 81, 139},
                                              {44, 113, 142},
                                              {33, 144, 141},
                                              {39, 173, 129},
                                              {92, 200, 99},
                                              {170, 220, 50},
                                              {253, 231, 37}}};

  // Interpolated between the nearest stops.
  if (!std::isfinite(s)) return {150, 150, 150};
  const double at = std::clamp(s, 0.0, 1.0) * static_cast<double>(kStops.size() - 1);
  const auto i = std::min(static_cast<std::size_t>(at), kStops.size() - 2);
  const double t = at - static_cast<double>(i);
  const auto mix = [t](std::uint8_t a, std::uint8_t b) {
    return static_cast<std::uint8_t>(std::lround((1.0 - t) * a + t * b));
  };

  const Rgb& a = kStops[i];
  const Rgb& b = kStops[i + 1];
  return {mix(a.r, b.r), mix(a.g, b.g), mix(a.b, b.b)};
}

}  // namespace plumbline::viz
