// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// PNG at compression level 1, fast: libdeflate needs a fifth of zlib's time for a noisy picture.
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace plumbline::synth {

/// CV_8UC3 (BGR) or CV_16UC1. Throws on other types.
std::vector<std::uint8_t> encode_png(const cv::Mat& image);

}  // namespace plumbline::synth
