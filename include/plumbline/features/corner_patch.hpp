// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Appearance of a corner, to find it again to a tenth of a pixel. FAST locates to whole pixels of an octave:
// the same corner lies half a pixel of its octave off from image to image, in x and in y.
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <optional>

namespace plumbline::features {

/// Grey values around a corner, in pixels of its octave.
struct CornerPatch {
  static constexpr int kReach = 4;              ///< half width of the aligned area
  static constexpr int kSide = 2 * kReach + 3;  ///< one more on each side, for gradients
  static constexpr int kPixels = kSide * kSide;
  Eigen::Vector2f middle = Eigen::Vector2f::Zero();  ///< position at which it was cut out, in the full image
  /// Offset from the middle to the position of the feature, pixels of the full image: zero for the corner
  /// itself; if a known landmark was aligned, to the landmark.
  Eigen::Vector2f offset = Eigen::Vector2f::Zero();
  /// All zero: no patch, as at depth borders (FeatureExtractor); nothing is aligned with it.
  std::array<std::uint8_t, kPixels> gray{};

  [[nodiscard]] bool empty() const {
    return std::all_of(gray.begin(), gray.end(), [](std::uint8_t g) { return g == 0; });
  }
};

/// The patch around pixel (x, y) of `level` (CV_8UC1), at least kReach + 1 pixels from its borders.
CornerPatch cut_patch(const cv::Mat& level, int x, int y, const Eigen::Vector2f& middle);

/// Position of the middle of `patch` in `level` (CV_8UC1), pixels of the level: least squares over its
/// position, gain and offset of the grey values (inverse compositional: Baker and Matthews 2004), from
/// `start`. `level_from_patch` maps differences of pixels. None if it leaves the image or two pixels around
/// `start`, does not converge, has no texture in two directions, or is not alike (correlation under 0.8).
std::optional<Eigen::Vector2f> align_patch(const CornerPatch& patch, const cv::Mat& level,
                                           const Eigen::Vector2f& start,
                                           const Eigen::Matrix2f& level_from_patch);

}  // namespace plumbline::features
