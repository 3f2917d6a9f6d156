// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/evaluate/statistics.hpp"

#include <algorithm>
#include <cmath>

namespace plumbline::evaluate {

Statistics summarize(const std::vector<double>& values) {
  // No values give zeros
  Statistics s;
  s.count = values.size();
  if (values.empty()) return s;

  // Sum and sum of squares
  const auto n = static_cast<double>(values.size());
  double sum = 0.0;
  for (const double e : values) {
    sum += e;
    s.sse += e * e;
  }

  // Mean, RMS and standard deviation
  s.mean = sum / n;
  s.rmse = std::sqrt(s.sse / n);
  double squares = 0.0;  // two passes: exact zero for equal values
  for (const double e : values) squares += (e - s.mean) * (e - s.mean);
  s.std = std::sqrt(squares / n);

  // Selection instead of sorting
  std::vector<double> order = values;
  const auto at = [&order](std::size_t rank) {
    std::nth_element(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(rank), order.end());
    return order[rank];
  };

  // Median, 90th percentile and range
  s.median = at(order.size() / 2);
  s.p90 = at((9 * order.size() + 9) / 10 - 1);
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  s.min = *least;
  s.max = *most;
  return s;
}

}  // namespace plumbline::evaluate
