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
  const double common = nearest({5000.0, 1000.0});
  const double median = median_raw / common;
  if (median >= kUsualMin && median <= kUsualMax) return common;
  return nearest({5000.0, 1000.0, 1.0, 100.0, 256.0, 6553.5, 10000.0});
}

}  // namespace plumbline::dataset
