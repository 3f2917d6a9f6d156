// SPDX-License-Identifier: BSD-3-Clause
#include "depth_roughness.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "plumbline/sensor/depth_noise.hpp"

namespace plumbline::features {

float depth_roughness(const cv::Mat& depth, int x, int y, int reach, int step) {
  constexpr float kUnknown = 1e3F;
  constexpr float kFewest = 12.0F;
  const float here = depth.at<float>(y, x);
  if (!(here > 0.0F)) return kUnknown;

  // Inverse depth is affine on a plane. Sums of opposite pixels give the mean without both slopes.
  float n = 0.0F, sum = 0.0F, squares = 0.0F;

  float wx = 0.0F, wy = 0.0F, xx = 0.0F, yy = 0.0F, xy = 0.0F;
  for (int dy = 0; dy <= reach; dy += step) {
    if (y - dy < 0 || y + dy >= depth.rows) break;

    const float* low = depth.ptr<float>(y + dy);
    const float* high = depth.ptr<float>(y - dy);
    for (int dx = dy == 0 ? step : -reach; dx <= reach; dx += step) {
      if (std::min(x + dx, x - dx) < 0 || std::max(x + dx, x - dx) >= depth.cols) continue;
      const float za = low[x + dx], zb = high[x - dx];
      if (!(za > 0.0F) || !(zb > 0.0F)) continue;

      const float a = here / za - 1.0F, b = here / zb - 1.0F;
      const auto u = static_cast<float>(dx), v = static_cast<float>(dy);
      n += 2.0F;

      sum += a + b;
      squares += a * a + b * b;
      wx += (a - b) * u;
      wy += (a - b) * v;
      xx += 2.0F * u * u;
      yy += 2.0F * v * v;
      xy += 2.0F * u * v;
    }
  }

  const float det = xx * yy - xy * xy;
  if (n < kFewest || !(det > 0.0F)) return kUnknown;

  // Residual about the plane, relative to the sensor's noise
  const float along_x = (yy * wx - xy * wy) / det, along_y = (xx * wy - xy * wx) / det;
  const float rest = squares - sum * sum / n - along_x * wx - along_y * wy;
  const float noise = static_cast<float>(sensor::depth_sigma(static_cast<double>(here))) / here;
  return std::sqrt(std::max(0.0F, rest) / (n - 3.0F)) / noise;
}

float roughness_limit(std::vector<float> roughness) {
  constexpr float kRougher = 2.0F;
  constexpr float kLeast = 0.2F;    // depth without any noise has steps of rounding
  constexpr std::size_t kFew = 30;  // fewer samples do not show the usual roughness: the model is used
  if (roughness.size() < kFew) return kRougher;

  // Relative to the usual roughness in this image
  const auto middle = roughness.begin() + static_cast<std::ptrdiff_t>(roughness.size() / 2);
  std::nth_element(roughness.begin(), middle, roughness.end());
  return kRougher * std::clamp(*middle, kLeast, 2.0F);
}

}  // namespace plumbline::features
