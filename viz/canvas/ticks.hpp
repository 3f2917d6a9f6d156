// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Ticks at round numbers.
#include <string>
#include <vector>

namespace plumbline::viz {

/// The greatest of 1, 2, 5 x 10^n that is at most `limit` (> 0).
double nice_number_below(double limit);

struct Tick {
  double value;
  std::string label;  ///< with as many decimals as the step needs
};
/// Ticks in [low, high] at multiples of 1, 2 or 5 x 10^n, about `wish` apart.
std::vector<Tick> nice_ticks(double low, double high, double wish);

}  // namespace plumbline::viz
