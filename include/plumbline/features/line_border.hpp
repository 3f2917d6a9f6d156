// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Frames of constant colour around an image (TUM's fr3 recordings have a black one, 1-3 px wide, at the
// right and bottom): every detector finds edges there.
#include <opencv2/core/mat.hpp>

namespace plumbline::features {

/// Rectangle of real image content in `gray` (CV_8UC1). Two kinds of rows or columns are cut off at each
/// side: those of one colour, at most `max_width`, that end in a visible step; then up to 3 more that are
/// clearly darker than their inner neighbours along at least a quarter of the side (frames of rectified
/// images fade out towards the corners). A dark or white scene without such a step is kept whole, as is an
/// empty or constant image.
cv::Rect valid_region(const cv::Mat& gray, int max_width = 16);

}  // namespace plumbline::features
