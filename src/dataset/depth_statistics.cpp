// SPDX-License-Identifier: BSD-3-Clause
#include "depth_statistics.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <iterator>

#include "plumbline/core/numbers.hpp"

namespace plumbline::dataset {
namespace {

constexpr double kRoomMedian = 2.0;  // metres
constexpr double kUsualMin = 0.7;
constexpr double kUsualMax = 7.0;

}  // namespace

void DepthStatistics::add(const cv::Mat& depth_m) {
  pixels_ += depth_m.total();
  for (int v = 0; v < depth_m.rows; ++v) {
    const auto* row = depth_m.ptr<float>(v);
    std::copy_if(row, row + depth_m.cols, std::back_inserter(measured_), [](float z) { return z > 0.0F; });
  }
}

std::optional<double> DepthStatistics::median() const {
  if (measured_.empty()) return std::nullopt;
  return static_cast<double>(core::median(measured_));
}

double DepthStatistics::share_beyond(double depth_m) const {
  if (measured_.empty()) return 0.0;
  const auto beyond = std::count_if(measured_.begin(), measured_.end(),
                                    [depth_m](float z) { return static_cast<double>(z) > depth_m; });
  return static_cast<double>(beyond) / static_cast<double>(measured_.size());
}

std::optional<double> DepthStatistics::disparity_step(double scale) const {
  constexpr std::size_t kLeastTimes = 20;  // that a depth is measured, to be a step
  constexpr double kLeastUnits = 4.0;      // raw units from step to step
  constexpr double kBand = 1.15;
  std::vector<float> sorted = measured_;
  std::sort(sorted.begin(), sorted.end());

  std::vector<double> values;
  std::size_t seldom = 0;
  for (std::size_t k = 0, end = 0; k < sorted.size(); k = end) {
    while (end < sorted.size() && sorted[end] == sorted[k]) ++end;
    if (end - k >= kLeastTimes)
      values.push_back(static_cast<double>(sorted[k]));
    else
      seldom += end - k;
  }
  if (seldom * 5 > sorted.size()) return std::nullopt;

  // The median step of 1 / z in each band of distances.
  std::vector<double> bands;

  for (std::size_t k = 0, end = 0; k < values.size(); k = end) {
    std::vector<double> steps;
    for (end = k + 1; end < values.size() && values[end] < kBand * values[k]; ++end) {
      const double units = (values[end] - values[end - 1]) * scale;
      if (units >= kLeastUnits) steps.push_back(1.0 / values[end - 1] - 1.0 / values[end]);
    }
    if (steps.size() >= 8 && steps.size() * 3 > (end - k) * 2)
      bands.push_back(core::median(std::move(steps)));
  }

  if (bands.size() < 3) return std::nullopt;
  const double step = core::median(bands);
  const auto alike =
      std::count_if(bands.begin(), bands.end(), [&](double b) { return b > 0.7 * step && b < 1.4 * step; });
  if (static_cast<std::size_t>(alike) * 4 < bands.size() * 3) return std::nullopt;
  return step;
}

double DepthStatistics::missing_share() const {
  if (pixels_ == 0) return 1.0;
  return 1.0 - static_cast<double>(measured_.size()) / static_cast<double>(pixels_);
}

double fitting_depth_scale(double median_raw) {
  const auto nearest = [&](std::initializer_list<double> scales) {
    const auto distance = [&](double scale) { return std::abs(std::log(median_raw / scale / kRoomMedian)); };
    return *std::min_element(scales.begin(), scales.end(),
                             [&](double a, double b) { return distance(a) < distance(b); });
  };

  // Common scales come first, because rare ones fit, too
  const double common = nearest({5000.0, 1000.0});
  const double median = median_raw / common;
  if (median >= kUsualMin && median <= kUsualMax) return common;
  return nearest({5000.0, 1000.0, 1.0, 100.0, 256.0, 6553.5, 10000.0});
}

}  // namespace plumbline::dataset
