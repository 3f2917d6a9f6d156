// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Conversion between measurements and features. A measurement is a pixel of the image as the lens projected
// it, in the row in which the shutter read it, with the depth as the depth camera gave it. A feature is made
// from it for a rectified image that was taken all at once. With this conversion features can be updated when
// the camera is calibrated again.
#include <Eigen/Core>
#include <vector>

#include "plumbline/features/frame_features.hpp"
#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/sensor/recalibration.hpp"

namespace plumbline::features {

struct PixelDepth {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  double depth = 0.0;  ///< metres; 0: none
};

/// The measurement behind a feature. `shutter_motion`: as FrameFeatures::shutter_motion.
PixelDepth measurement_of(const PixelDepth& feature, const geometry::Vector6d& shutter_motion,
                          const sensor::ImageModel& model);
/// The feature that a measurement gives.
PixelDepth feature_of(const PixelDepth& measurement, const geometry::Vector6d& shutter_motion,
                      const sensor::ImageModel& model);

/// Rate at which the depth on the ray to a point `p` of a surface changes as the camera moves, m/s (camera
/// frame); the surface is carried along by the camera's motion. 0 if its normal is not known (zero), or the
/// ray grazes it.
double depth_rate(const Eigen::Vector3d& p, const Eigen::Vector3d& normal,
                  const geometry::Vector6d& velocity);

/// Computes the features again for another camera. `velocity` (m/s, rad/s): current estimate of the velocity
/// of camera_from_world, in its own frame. `depth_rates` (m/s), one per point or none at all: rates at which
/// the depth on their rays changes as the camera moves, needed if the delay of the depth image changes.
void recalibrate(FrameFeatures& features, const sensor::Recalibration& change,
                 const geometry::Vector6d& velocity, const std::vector<double>& depth_rates);

}  // namespace plumbline::features
