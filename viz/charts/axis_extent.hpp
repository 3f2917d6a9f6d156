// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// From where to where the axes of a chart go.
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "plumbline/viz/svg_chart.hpp"

namespace plumbline::viz {

/// Of the finite values.
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

/// About its middle.
inline void widen(AxisRange& range, double factor) {
  const double middle = 0.5 * (range.first + range.second);
  const double half = 0.5 * (range.second - range.first) * factor;
  range = {middle - half, middle + half};
}

}  // namespace plumbline::viz
