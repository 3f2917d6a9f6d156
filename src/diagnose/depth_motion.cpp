// SPDX-License-Identifier: BSD-3-Clause
#include "depth_motion.hpp"

#include <cmath>
#include <cstddef>
#include <opencv2/imgproc.hpp>

#include "plumbline/diagnose/signs.hpp"

namespace plumbline::diagnose {

/// Share of pixels whose depth changed between groups of samples.
double moved_share(const std::vector<Sample>& samples) {
  constexpr int kStep = 4;
  constexpr float kMoved = 0.04F;
  std::size_t moved = 0, both = 0;

  // Groups have four frames: the first ones are compared.
  for (std::size_t k = 4; k < samples.size(); k += 4) {
    const cv::Mat& a = samples[k - 4].depth;
    const cv::Mat& b = samples[k].depth;

    for (int v = 0; v < a.rows; v += kStep) {
      const auto* row_a = a.ptr<float>(v);
      const auto* row_b = b.ptr<float>(v);

      // Only pixels with both depths count.
      for (int u = 0; u < a.cols; u += kStep) {
        if (!(row_a[u] > 0.0F) || !(row_b[u] > 0.0F)) continue;
        ++both;
        moved += std::abs(row_a[u] - row_b[u]) > kMoved * row_a[u] ? 1 : 0;
      }
    }
  }

  return both > 0 ? static_cast<double>(moved) / static_cast<double>(both) : 0.0;
}

bool stood_still(const Samples& samples) {
  constexpr double kMostMoved = 0.05;
  constexpr double kLeastAlike = 0.998;
  const std::vector<Sample> all = samples.samples();
  if (all.size() < 8 || moved_share(all) > kMostMoved) return false;

  // Images must agree as well as depths.
  cv::Mat before, now, alike;
  for (std::size_t k = 0; k < all.size(); k += 4) {
    cv::resize(all[k].gray, now, {80, 60}, 0.0, 0.0, cv::INTER_AREA);
    if (k > 0) {
      cv::matchTemplate(now, before, alike, cv::TM_CCOEFF_NORMED);
      if (alike.at<float>(0, 0) < kLeastAlike) return false;
    }
    before = now.clone();
  }
  return true;
}

}  // namespace plumbline::diagnose
