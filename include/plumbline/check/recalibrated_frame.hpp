// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Small pictures as another calibration of their camera makes them.
#include <opencv2/core/mat.hpp>

#include "plumbline/check/frame_store.hpp"
#include "plumbline/sensor/recalibration.hpp"

namespace plumbline::check {

/// Const methods are thread-safe.
class RecalibratedFrame {
 public:
  /// Both cameras' pictures are rectified into `image`.
  RecalibratedFrame(const sensor::Pinhole& image, const sensor::Camera& before, const sensor::Camera& after);
  [[nodiscard]] SmallFrame operator()(const SmallFrame& frame) const;
  /// Additional delay of depth images, seconds.
  [[nodiscard]] double delay_s() const { return delay_s_; }

 private:
  double delay_s_ = 0.0;
  cv::Mat gray_from_;   ///< CV_32FC2: pixels of the small picture before; empty: they stay
  cv::Mat depth_from_;  ///< CV_16SC2: grid points before; empty: depth stays
  cv::Mat slope_;       ///< CV_32FC1: added to 1 / depth, 1/m
};

}  // namespace plumbline::check
