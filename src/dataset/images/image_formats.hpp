// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// OpenCV's image formats, a separate part (core/part.hpp): read_image decodes what recordings are made of
// without it.
#include "images/image_decoders.hpp"
#include "plumbline/core/part.hpp"

namespace plumbline::dataset {

struct ImageFormats {
  static constexpr const char* kPart = "images";
  static constexpr std::uint64_t layout() { return core::layout_of<ImageFormats, Bytes, cv::Mat>(); }

  /// The image as it is stored, not converted; empty if it cannot be decoded.
  cv::Mat (*decode)(const Bytes& file);
  /// Empty when it cannot be.
  Bytes (*encode_png)(const cv::Mat& image, int level);
  /// Empty when it cannot be.
  Bytes (*encode_tiff)(const cv::Mat& image);
};

}  // namespace plumbline::dataset
