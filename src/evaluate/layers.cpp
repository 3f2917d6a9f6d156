// SPDX-License-Identifier: BSD-3-Clause
#include "layers.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace plumbline::evaluate {
namespace {
constexpr double kLeastSeparation = 1e-4;  // m; above the rounding of coordinates

double spread(std::vector<double>::const_iterator first, std::vector<double>::const_iterator last) {
  const auto n = static_cast<double>(last - first);
  const double mean = std::accumulate(first, last, 0.0) / n;
  double squares = 0.0;
  for (auto h = first; h != last; ++h) squares += (*h - mean) * (*h - mean);
  return std::sqrt(squares / n);
}
}  // namespace

double Layers::thickness() const { return std::sqrt(spread * spread + separation * separation); }

Layers split_layers(std::vector<double>& heights) {
  if (heights.empty()) return {};

  // Mean and spread of a single layer
  std::sort(heights.begin(), heights.end());
  const auto n = static_cast<double>(heights.size());
  double sum = 0.0;
  for (const double h : heights) sum += h;
  const double mean = sum / n;
  double total = 0.0;  // sum of squares about the mean
  for (const double h : heights) total += (h - mean) * (h - mean);

  // The best split maximises the variance between layers
  const std::size_t least = std::max<std::size_t>(2, (heights.size() + 9) / 10);
  double low_sum = 0.0;
  double best_between = -1.0;
  double best_separation = 0.0;
  std::size_t best_split = 0;
  for (std::size_t k = 1; k < heights.size(); ++k) {
    low_sum += heights[k - 1] - mean;
    if (k < least || heights.size() - k < least) continue;

    // Otsu's criterion
    const auto low = static_cast<double>(k);
    const double separation = -low_sum / (n - low) - low_sum / low;
    const double between = low * (n - low) / n * separation * separation;
    if (between > best_between) {
      best_between = between;
      best_separation = separation;
      best_split = k;
    }
  }

  // Two layers must be clearly apart
  if (best_split == 0) return {false, std::sqrt(total / n), 0.0, 0.0};  // too few for two
  const double within = std::max(0.0, total - best_between) / n;        // mean square about the layers' means
  const auto split = heights.begin() + static_cast<std::ptrdiff_t>(best_split);
  const double widest = std::max(spread(heights.begin(), split), spread(split, heights.end()));
  if (best_separation > kLeastSeparation && best_separation >= 4.0 * widest) {
    return {true, std::sqrt(within), best_separation, *split};
  }
  return {false, std::sqrt(total / n), 0.0, 0.0};
}

}  // namespace plumbline::evaluate
