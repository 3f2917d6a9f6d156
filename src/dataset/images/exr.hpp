// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// OpenEXR images, which OpenCV's decoder has switched off unless the environment says otherwise.
#include "images/image_decoders.hpp"

namespace plumbline::dataset {

bool is_exr(const Bytes& file);
/// One channel (Z, Y, R, or the only one) as CV_32FC1; empty when it cannot be read. Size is checked before
/// memory is taken.
cv::Mat decode_exr(const Bytes& file);

}  // namespace plumbline::dataset
