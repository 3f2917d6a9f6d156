// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Images of recordings: quick, strict and quiet decoding.
#include <cstdint>
#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "plumbline/core/error.hpp"

namespace plumbline::dataset {

/// Decodes a file as it is stored: CV_8U or CV_16U with 1, 3 (BGR) or 4 channels, or floats (TIFF; of EXR one
/// channel). PNG and JPEG (of CMYK as BGR) are read by strict decoders, EXR by OpenEXR, other formats by
/// OpenCV. A file that ends early or whose checksums are wrong is an error ("truncated or damaged") and never
/// a half-filled image. Thread-safe.
core::Result<cv::Mat> read_image(const std::filesystem::path& file);

/// CV_8U with 1, 3 (BGR) or 4 channels, or CV_16U with one, as the bytes of a PNG file. `level`: 0 (large and
/// quick) to 9 (small). Thread-safe.
core::Result<std::vector<std::uint8_t>> encode_png(const cv::Mat& image, int level);
/// CV_32FC1 as the bytes of a TIFF file, without loss. Thread-safe.
core::Result<std::vector<std::uint8_t>> encode_tiff(const cv::Mat& image);
/// PNG into a file, quickly packed; errors name the file.
core::Result<void> write_png(const std::filesystem::path& file, const cv::Mat& image);

}  // namespace plumbline::dataset
