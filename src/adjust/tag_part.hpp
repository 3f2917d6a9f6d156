// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "plumbline/core/part.hpp"

namespace plumbline::adjust {

/// A tag in a picture.
struct SeenTag {
  int id = 0;
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();  ///< where its diagonals cross, px
};

/// Functions of the part "tags".
struct TagFunctions {
  static constexpr const char* kPart = "tags";
  static constexpr std::uint64_t layout() { return core::layout_of<TagFunctions, SeenTag>(); }
  /// `grey`: CV_8UC1. Thread-safe.
  std::vector<SeenTag> (*detect)(const cv::Mat& grey, const std::string& family);
};

}  // namespace plumbline::adjust
