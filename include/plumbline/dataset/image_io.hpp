// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Images of recordings: quick, strict and quiet decoding.
#include <filesystem>
#include <opencv2/core/mat.hpp>

#include "plumbline/core/error.hpp"

namespace plumbline::dataset {

/// Decodes a file as it is stored: CV_8U with 1, 3 (BGR) or 4 channels, or CV_16U. PNG and JPEG are read
/// by strict decoders, other formats by OpenCV. A file that ends early or whose checksums are wrong is an
/// error ("truncated or damaged") and never a half-filled image. Thread-safe.
core::Result<cv::Mat> read_image(const std::filesystem::path& file);

}  // namespace plumbline::dataset
