// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// JPEG files in memory: images for pages, and keyframes' images for a map's store.
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "plumbline/core/error.hpp"

namespace plumbline::dataset {

/// The bytes of a JPEG file; empty if it cannot be encoded. `bgr`: CV_8UC3; `quality`: 1 to 100. Thread-safe.
std::vector<std::uint8_t> encode_jpeg(const cv::Mat& bgr, int quality);

/// The image reduced to a width of 160 pixels, in the best quality that fits into 5000 bytes; empty if none
/// does. `bgr`: CV_8UC3. Thread-safe.
std::vector<std::uint8_t> encode_small_jpeg(const cv::Mat& bgr);

/// CV_8UC3 (BGR), or CV_8UC1 where the file has one channel. Errors (kInput): truncated or damaged.
/// Thread-safe.
core::Result<cv::Mat> decode_jpeg_bytes(const std::vector<std::uint8_t>& file);

}  // namespace plumbline::dataset
