// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Orientation and descriptor of ORB points (Rublee, Rabaud, Konolige, Bradski, ICCV 2011) on one level of a
// pyramid: the same bits as cv::ORB.
#include <opencv2/core/mat.hpp>

#include "plumbline/features/descriptor.hpp"

namespace plumbline::features {

/// Pixels around a point that must lie inside the picture.
constexpr int kOrbMargin = 19;

/// Angle of the intensity centroid of the circular patch of radius 15 px around (x, y), degrees [0, 360).
/// `image` is CV_8UC1 and has one more column to the right of the patch.
float orb_orientation(const cv::Mat& image, int x, int y);

/// Gaussian of sigma 2 px over 7 x 7, as cv::GaussianBlur makes it, reflected at the borders: what
/// descriptors are read from. `image` is CV_8UC1, at least 4 x 4.
cv::Mat orb_smooth(const cv::Mat& image);

/// `smooth`: of orb_smooth. kOrbMargin must be kept.
Descriptor256 orb_descriptor(const cv::Mat& smooth, int x, int y, float angle_degrees);

}  // namespace plumbline::features
