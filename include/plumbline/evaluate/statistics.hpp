// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Statistics of a list of errors.
#include <cstddef>
#include <vector>

namespace plumbline::evaluate {

/// Statistics of n values e, in their unit. Zeros when n = 0.
struct Statistics {
  std::size_t count = 0;
  double rmse = 0.0;    ///< sqrt(sum e^2 / n)
  double mean = 0.0;    ///< sum e / n
  double median = 0.0;  ///< sorted[n / 2], the upper one of two middle values
  double min = 0.0;
  double max = 0.0;
  double sse = 0.0;  ///< sum e^2, unit squared
  double std = 0.0;  ///< sqrt(sum (e - mean)^2 / n)
  double p90 = 0.0;  ///< 90th percentile by nearest rank: sorted[ceil(0.9 n) - 1]
};

/// Values must be finite. Sums run in the order given.
Statistics summarize(const std::vector<double>& values);

}  // namespace plumbline::evaluate
