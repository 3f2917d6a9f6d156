// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Decoders behind read_image. They return what is wrong as text without the file's name.
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "plumbline/core/error.hpp"

namespace plumbline::dataset {

using Bytes = std::vector<std::uint8_t>;
using Decoded = tl::expected<cv::Mat, std::string>;

// 134 megapixels: beyond any depth camera, small enough to allocate.
constexpr std::int64_t kMaxPixels = 1 << 27;

bool is_png(const Bytes& file);
bool is_jpeg(const Bytes& file);
/// Checks every chunk's checksum and the end mark, then inflates and unfilters. Kinds of PNG that no depth
/// camera writes (palette, interlaced, 1-4 bit) go to OpenCV after the check.
Decoded decode_png(const Bytes& file);
/// libjpeg with lost data treated as an error: by default it would fill missing parts with grey.
Decoded decode_jpeg(const Bytes& file);
Decoded decode_other(const Bytes& file);
/// Any of these. Error (kInput): names the image and what is wrong.
core::Result<cv::Mat> decode_image(const std::string& name, const Bytes& file);
/// NumPy's .npy: an array of two dimensions, or three of which one is 1, of float32 (CV_32FC1), float64
/// (CV_64FC1) or uint16 (CV_16UC1) in little endian, row by row.
bool is_npy(const Bytes& file);
Decoded decode_npy(const Bytes& file);

}  // namespace plumbline::dataset
