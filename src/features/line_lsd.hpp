// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Line segment detector (Grompone von Gioi, Jakubowicz, Morel, Randall, PAMI 32, 2010;
// docs/method/features.md).
#include <opencv2/core/mat.hpp>
#include <vector>

namespace plumbline::features {

/// Segments x0 y0 x1 y1 of `image` (CV_8UC1), pixels of that image; shorter than `min_length` ones left out,
/// and pixels whose gradient is under `min_gradient` (grey levels per px) never join; gradients under the
/// published 5.2 join only where there are few strong ones. Several times as fast as cv::LineSegmentDetector:
/// angles are compared as unit vectors, so the growing of regions needs no arc tangent, and everything is
/// float over flat arrays. `exact`: the number of false alarms as published, not by a bound of its sum.
std::vector<cv::Vec4f> detect_lsd(const cv::Mat& image, float min_length, float min_gradient,
                                  bool exact = false);

}  // namespace plumbline::features
