// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Images for direct alignment: grey values without anything wider than a few pixels (exposure, vignetting,
// shading), and the surface points where they were seen. A painted wall has no corners, but thousands of
// pixels of faint texture, which together hold a camera to a fraction of a pixel.
#include <array>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/sensor/camera.hpp"

namespace plumbline::features {

/// Half of the image's size, and a quarter.
constexpr std::size_t kPhotometricLevels = 2;

/// CV_32FC1, grey values less their mean around the pixel; no levels: no image.
using PhotometricImage = std::array<cv::Mat, kPhotometricLevels>;

/// `gray`: CV_8UC1.
PhotometricImage make_photometric_image(const cv::Mat& gray);

/// The camera of a level's image; level 0 has half of the image's size.
sensor::Pinhole photometric_camera(const sensor::Pinhole& camera, std::size_t level);

/// A point on a surface with its grey value and gradient.
struct PhotometricSample {
  Eigen::Vector3f point = Eigen::Vector3f::Zero();     ///< camera frame, metres
  float value = 0.0F;                                  ///< grey value in the level's image
  Eigen::Vector2f gradient = Eigen::Vector2f::Zero();  ///< per pixel of the level
};
using PhotometricSamples = std::array<std::vector<PhotometricSample>, kPhotometricLevels>;

/// Samples of a level's image: of each cell the pixel with the steepest gradient, where depth is continuous.
/// `depth`: CV_32FC1, metres, 0 = none, of the image's size, registered to it; `camera_from_depth`: pose of
/// the depth camera in the camera, as their stamps differ.
PhotometricSamples sample_photometric(const PhotometricImage& image, const cv::Mat& depth,
                                      const sensor::Pinhole& camera,
                                      const geometry::Rigid3& camera_from_depth);

}  // namespace plumbline::features
