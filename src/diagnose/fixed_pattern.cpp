// SPDX-License-Identifier: BSD-3-Clause
// Dots, dirt and time stamps stay where they are while what the camera sees moves through the picture.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "depth_motion.hpp"
#include "grade.hpp"

namespace plumbline::diagnose {
namespace {

constexpr std::size_t kFrames = 16;
constexpr float kStrong = 12.0F;  // grey values above the neighbourhood
constexpr double kMovedShare = 0.1;
constexpr double kShare = 0.08;      // of the details
constexpr double kOfPicture = 5e-3;  // dirt and time stamps have less

/// Difference from the pixels to either side, along a row and along a column: the smaller one if they agree.
/// Edges have none, which a camera that moves along them leaves where they are.
cv::Mat details_of(const cv::Mat& gray) {
  constexpr int kReach = 4;
  cv::Mat details(gray.size(), CV_32FC1, cv::Scalar(0.0));
  for (int v = kReach; v < gray.rows - kReach; ++v) {
    const auto* row = gray.ptr<unsigned char>(v);
    const auto* up = gray.ptr<unsigned char>(v - kReach);
    const auto* down = gray.ptr<unsigned char>(v + kReach);
    auto* to = details.ptr<float>(v);
    for (int u = kReach; u < gray.cols - kReach; ++u) {
      const int across = 2 * row[u] - row[u - kReach] - row[u + kReach];
      const int along = 2 * row[u] - up[u] - down[u];
      if ((across > 0) != (along > 0)) continue;
      to[u] = 0.5F * static_cast<float>(std::abs(across) < std::abs(along) ? across : along);
    }
  }
  return details;
}

}  // namespace

Sign fixed_pattern_sign(const Samples& samples) {
  Sign sign{"fixed_pattern", "of the details"};

  std::vector<cv::Mat> details;
  std::vector<Sample> all = samples.samples();
  double strong = 0.0;

  // Two frames of each group, some time apart.
  for (std::size_t k = 0; k < all.size() && details.size() < kFrames; ++k) {
    if (k % 4 != 0 && k % 4 != 3) continue;
    details.push_back(details_of(all[k].gray));
    strong += cv::countNonZero(cv::abs(details.back()) > kStrong);
  }
  if (details.size() < kFrames / 2) return sign;

  // A pixel is fixed if it differs from its neighbourhood in the same way in nearly every picture.
  const auto n = details.size();
  const std::size_t least = n - n / 8;
  std::size_t fixed = 0;

  for (int v = 0; v < details.front().rows; ++v) {
    std::array<const float*, kFrames> rows{};
    for (std::size_t k = 0; k < n; ++k) rows[k] = details[k].ptr<float>(v);

    for (int u = 0; u < details.front().cols; ++u) {
      std::size_t above = 0, below = 0;
      for (std::size_t k = 0; k < n; ++k) {
        above += rows[k][u] > kStrong ? 1 : 0;
        below += rows[k][u] < -kStrong ? 1 : 0;
      }
      fixed += above >= least || below >= least ? 1 : 0;
    }
  }

  // Share of all details, and share of all pixels.
  const double share = strong > 0.0 ? static_cast<double>(fixed * n) / strong : 0.0;
  const double of_picture = static_cast<double>(fixed) / static_cast<double>(details.front().total());
  sign.size = share;
  if (!grade(sign, {share / kShare, of_picture / kOfPicture, moved_share(all) / kMovedShare})) return sign;

  sign.text = fmt::format(
      "a pattern stays in the picture while the camera moves ({:.0f} % of all details, {:.2g} % of the "
      "pixels): dots of an infrared emitter, dirt on the lens or writing",
      100.0 * share, 100.0 * of_picture);
  sign.remedy =
      "record the colour camera's pictures, or switch the emitter off, clean the lens, leave out the writing";
  return sign;
}

}  // namespace plumbline::diagnose
