// SPDX-License-Identifier: BSD-3-Clause
#include "canvas/ticks.hpp"

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

std::vector<Tick> nice_ticks(double low, double high, double wish) {
  std::vector<Tick> ticks;
  const double span = high - low;
  if (!(span > 0.0) || !std::isfinite(span) || !(wish > 0.0)) return ticks;
  // The step nearest to the requested one rather than the one below it, which may give twice as many.
  const double step = nice_number_below(1.5 * wish);
  constexpr double kMostSteps = 1e12;  // from zero: beyond, neighbouring ticks are soon the same number
  if (std::max(std::abs(low), std::abs(high)) > kMostSteps * step) return ticks;
  const int decimals = std::clamp(static_cast<int>(std::ceil(-std::log10(step) - 1e-9)), 0, 12);
  const bool scientific = step >= 1e6 || step < 1e-6;
  for (double k = std::ceil(low / step - 1e-6); k * step <= high + 1e-6 * span; k += 1.0) {
    const double value = k == 0.0 ? 0.0 : k * step;  // no "-0"
    ticks.push_back(
        {value, scientific ? fmt::format("{:.3g}", value) : fmt::format("{:.{}f}", value, decimals)});
  }
  return ticks;
}

}  // namespace plumbline::viz
