// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Frames of constant colour around a picture (TUM's fr3 recordings have a black one, 1-3 px wide, at the
// right and bottom): every detector takes them for edges.
#include <opencv2/core/mat.hpp>

namespace plumbline::features {

/// Rectangle of real picture content in `gray` (CV_8UC1): rows and columns at the sides whose pixels are all
/// the same and that end in a visible step are cut off, at most `max_width` at each side. A dark or white
/// scene that merely has little contrast at its side is kept whole, as is an empty or constant picture.
cv::Rect valid_region(const cv::Mat& gray, int max_width = 16);

}  // namespace plumbline::features
