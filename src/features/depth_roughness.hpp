// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Borders of depth too low to stand out from its noise in a single pixel: a book before a box, a screen
// before a wall.
#include <opencv2/core/mat.hpp>
#include <vector>

namespace plumbline::features {

/// Deviation of the depth image (CV_32FC1, metres, 0 = none) within `reach` pixels of (x, y) from the plane
/// through it: root mean square, in standard deviations of the sensor's noise. Every `step`-th pixel is used,
/// each together with the opposite one. A huge number if too few were measured.
float depth_roughness(const cv::Mat& depth, int x, int y, int reach, int step);

/// Roughness above which there is a depth border: a multiple of the roughness of most of the image, because a
/// sensor may be better or worse than its model. `roughness`: one number for each sampled position, in any
/// order.
float roughness_limit(std::vector<float> roughness);

}  // namespace plumbline::features
