// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A picture whose grey values are known between pixels too.
#include <cmath>
#include <functional>
#include <opencv2/core.hpp>
#include <vector>

#include "random_world.hpp"

namespace plumbline::tests {

/// Waves of all directions, 6 px long and more: grey value at any place of the plane, 30 to 220 or so.
class Waves {
 public:
  explicit Waves(std::uint32_t seed) {
    Random random(seed);
    for (int i = 0; i < 24; ++i) {
      const double angle = random.uniform(0.0, 6.283);
      const double rate = 6.283 / random.uniform(6.0, 18.0);
      waves_.push_back({rate * std::cos(angle), rate * std::sin(angle), random.uniform(0.0, 6.283)});
    }
  }
  double operator()(double x, double y) const {
    double sum = 0.0;
    for (const Wave& w : waves_) sum += std::sin(w.x * x + w.y * y + w.phase);
    return 125.0 + 16.0 * sum;
  }

 private:
  struct Wave {
    double x, y, phase;
  };
  std::vector<Wave> waves_;
};

/// CV_8UC1 whose pixel (x, y) has the value `gray` has there.
inline cv::Mat draw(int width, int height, const std::function<double(double, double)>& gray) {
  cv::Mat image(height, width, CV_8UC1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x)
      image.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(gray(x, y));
  }
  return image;
}

}  // namespace plumbline::tests
