// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Borders of depth too low to stand out from its noise in a single pixel: a book before a box, a screen
// before a wall.
#include <opencv2/core/mat.hpp>
#include <vector>

namespace plumbline::features {

/// How far the depth image (CV_32FC1, metres, 0 = none) within `reach` pixels of (x, y) is off the plane
/// through it: root mean square, standard deviations of the sensor's noise. Every `step`-th pixel is asked,
/// opposite ones together. A huge number where too few were measured.
float depth_roughness(const cv::Mat& depth, int x, int y, int reach, int step);

/// What is rougher than this has a border: so many times as rough as most of the image. A sensor may be
/// better or worse than its model. `roughness`: one number for each place that was asked, in any order.
float roughness_limit(std::vector<float> roughness);

}  // namespace plumbline::features
