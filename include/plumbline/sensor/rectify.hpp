// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Undistortion and depth registration: what turns a raw pair into images of one pinhole camera.
#include <memory>
#include <opencv2/core/mat.hpp>

#include "plumbline/sensor/camera.hpp"

namespace plumbline::sensor {

/// Precomputed maps for one camera. Const methods are thread-safe.
class Rectifier {
 public:
  explicit Rectifier(const Camera& camera) : Rectifier(camera, camera.color) {}
  /// Rectifies into images of the pinhole camera `target`, of the same size, instead of `camera.color`.
  Rectifier(const Camera& camera, const Pinhole& target);
  ~Rectifier();
  /// Undistorts an 8-bit image, 1 or 3 channels, of the camera's size (bilinear); returns the same image if
  /// there is nothing to undo. Areas that no source pixel covers repeat the rim (depth is 0 there). Throws
  /// std::invalid_argument on an image of another kind or size; so does depth().
  [[nodiscard]] cv::Mat color(const cv::Mat& raw) const;
  /// Raw 16-bit depth -> CV_32FC1 metres in the undistorted colour camera. 0 and 65535 become 0. Registers
  /// with color_from_depth (z-buffered splat, no holes torn by the change of resolution) when present;
  /// undistorts by nearest neighbour (depth is never mixed across borders); then takes out the depth_slope.
  [[nodiscard]] cv::Mat depth(const cv::Mat& raw16) const;

 private:
  struct Maps;
  std::unique_ptr<const Maps> maps_;
};

}  // namespace plumbline::sensor
