// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Direct alignment of two small blurred images: a guess of the motion that needs no feature and that blur
// does not hurt (compare Klein & Murray, ECCV 2008, and Kerl et al., ICRA 2013).
#include <opencv2/core/mat.hpp>

#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/sensor/camera.hpp"

namespace plumbline::tracking {

struct ThumbnailAlignment {
  geometry::Rigid3 current_from_previous;
  double rms = 0.0;          ///< grey values, of the aligned pixels
  double initial_rms = 0.0;  ///< with the first guess
  int pixels = 0;
  bool better = false;  ///< clearly better than the first guess
};

/// `previous`, `current`: CV_32FC1 thumbnails; `previous_depth`: the same size, metres, 0 = none; `camera`:
/// of the full image. A change of overall brightness is estimated along.
ThumbnailAlignment align_thumbnails(const cv::Mat& previous, const cv::Mat& previous_depth,
                                    const cv::Mat& current, const sensor::Pinhole& camera,
                                    const geometry::Rigid3& guess);

}  // namespace plumbline::tracking
