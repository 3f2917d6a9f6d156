// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// One RGB-D observation.
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <optional>

#include "plumbline/geometry/rigid3.hpp"

namespace plumbline::sensor {

/// Colour and depth that belong together. After rectification both are images of the undistorted pinhole
/// camera Camera::color, pixel for pixel.
struct RgbdFrame {
  std::int64_t index = -1;   ///< position in the recording
  double stamp = 0.0;        ///< stamp of colour, seconds
  double depth_stamp = 0.0;  ///< stamp of depth, seconds
  cv::Mat color;             ///< CV_8UC3, BGR
  cv::Mat gray;              ///< CV_8UC1
  cv::Mat depth;             ///< CV_32FC1, metres along z, 0 = no measurement
  /// world_from_camera by the recorder's own odometry (a phone's), in a world of its own; none: not known.
  std::optional<geometry::Rigid3> odometry{};
};

}  // namespace plumbline::sensor
