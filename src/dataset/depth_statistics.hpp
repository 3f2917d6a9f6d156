// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Depth of a few sample frames, and signs that its unit is wrong.
#include <cstddef>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

namespace plumbline::dataset {

class DepthStatistics {
 public:
  void add(const cv::Mat& depth_m);  ///< CV_32FC1, 0 = no measurement
  [[nodiscard]] std::optional<double> median() const;
  /// Share of the measured pixels; 0 if there are none.
  [[nodiscard]] double share_beyond(double depth_m) const;
  /// Step of 1 / z between depths that are measured, 1/m, where they are those of a disparity: the same at
  /// several distances, and coarser than a raw unit; `scale`: raw units a metre.
  [[nodiscard]] std::optional<double> disparity_step(double scale) const;
  [[nodiscard]] double missing_share() const;  ///< share of all pixels; 1 without pixels

 private:
  std::vector<float> measured_;
  std::size_t pixels_ = 0;
};

/// Among the scales in use, the one that brings the raw median depth nearest to that of a room. 5000 (TUM)
/// and 1000 (millimetres) come first: the others only when neither gives a usual depth.
double fitting_depth_scale(double median_raw);

}  // namespace plumbline::dataset
