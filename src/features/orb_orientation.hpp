// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Orientation of ORB points (Rublee, Rabaud, Konolige, Bradski, ICCV 2011).
#include <opencv2/core/mat.hpp>

namespace plumbline::features {

/// Angle of the intensity centroid of the circular patch of radius 15 px around (x, y), degrees [0, 360).
/// `image` is CV_8UC1 and has one more column to the right of the patch.
float orb_orientation(const cv::Mat& image, int x, int y);

}  // namespace plumbline::features
