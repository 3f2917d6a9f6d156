// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Line segment detector (Grompone von Gioi, Jakubowicz, Morel, Randall, PAMI 32, 2010;
// docs/method/features.md).
#include <opencv2/core/mat.hpp>
#include <vector>

namespace plumbline::features {

/// Segments x0 y0 x1 y1 of `image` (CV_8UC1), in its pixels. Segments shorter than `min_length` are left out.
/// Pixels with a gradient under `min_gradient` (grey levels per px) are never used, and gradients under the
/// published 5.2 only where there are few strong ones. Several times faster than cv::LineSegmentDetector:
/// angles are compared as unit vectors, so growing regions needs no arc tangent, and everything is float in
/// flat arrays. `exact`: computes the number of false alarms as published, not by a bound of its sum.
std::vector<cv::Vec4f> detect_lsd(const cv::Mat& image, float min_length, float min_gradient,
                                  bool exact = false);

}  // namespace plumbline::features
