// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Effect of the camera's motion on an image that was not taken at one moment.
#include <memory>

#include "plumbline/features/frame_features.hpp"
#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/sensor/camera.hpp"
#include "plumbline/sensor/frame.hpp"

namespace plumbline::tracking {

struct ImageMotion {
  geometry::Vector6d shutter = geometry::Vector6d::Zero();  ///< while the colour image was read
  geometry::Rigid3 depth_from_camera;                       ///< from the colour image's stamp to the depth's

  [[nodiscard]] bool moves_depth() const {
    return !depth_from_camera.translation.isZero(0.0) || !depth_from_camera.rotation.isIdentity(0.0);
  }
};

/// Features as if all rows of the image, and the depth image, had been taken at the colour image's stamp.
std::shared_ptr<const features::FrameFeatures> synchronised(
    const std::shared_ptr<const features::FrameFeatures>& features, const cv::Mat& depth,
    const sensor::Pinhole& camera, const ImageMotion& motion);

/// A frame that is searched for in the map.
struct TrackedImage {
  const sensor::RgbdFrame& frame;
  std::shared_ptr<const features::FrameFeatures> measured;
  ImageMotion motion;  ///< as the motion model predicts it
  std::shared_ptr<const features::FrameFeatures> synchronised;
};

}  // namespace plumbline::tracking
