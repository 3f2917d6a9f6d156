// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <string>

namespace plumbline::exports {

/// JPEG of a picture, 8 bit, blue, green, red. `quality`: 1 to 100. Empty: it cannot be written.
std::string encode_jpeg(const cv::Mat& bgr, int quality);

}  // namespace plumbline::exports
