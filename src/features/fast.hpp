// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// FAST corners (Rosten, Porter, Drummond, PAMI 32, 2010): 9 contiguous pixels of the circle of 16, scored by
// the largest threshold at which they still are a corner, non-maxima suppressed. The same corners in the same
// order as cv::FAST, several times quicker: all scores of a row at once, without a branch per pixel.
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace plumbline::features {

struct Corner {
  std::int32_t x = 0;  ///< pixels from the image's own corner
  std::int32_t y = 0;
  std::int32_t score = 0;  ///< grey values, 1-254
};

/// Corners of `image` (CV_8UC1) with a score of at least `threshold` (1-254), row by row. The circle has a
/// radius of 3 px and stays inside.
std::vector<Corner> fast_corners(const cv::Mat& image, int threshold);

}  // namespace plumbline::features
