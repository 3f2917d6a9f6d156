// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Lines of a frame: detection, descriptors and 3D lines from depth.
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "plumbline/core/options.hpp"
#include "plumbline/features/lbd.hpp"
#include "plumbline/features/line_depth.hpp"
#include "plumbline/features/line_detector.hpp"

namespace plumbline::features {

struct LineFeature {
  LineSegment segment;
  LineDescriptor descriptor{};
  std::optional<Line3> line3;  ///< none if depth does not support one 3D line: the line stays 2D
};

struct LineOptions {
  LineDetectorOptions detector;
  LineDepthOptions depth;

  /// Declares the detector's options under their own keys, those of the depth fit with the prefix "depth_".
  void declare(core::OptionTable& table);
};

/// Thread-safe.
class LineExtractor {
 public:
  explicit LineExtractor(const LineOptions& options = {}) : options_(options), detector_(options.detector) {}

  /// Lines of `gray` (CV_8UC1), longest first. `depth_m` (CV_32FC1, metres, 0 = none) may be empty: then all
  /// lines stay 2D. Both must be images of `camera`.
  [[nodiscard]] std::vector<LineFeature> extract(const cv::Mat& gray, const cv::Mat& depth_m,
                                                 const sensor::Pinhole& camera) const;

 private:
  LineOptions options_;
  LineDetector detector_;
};

}  // namespace plumbline::features
