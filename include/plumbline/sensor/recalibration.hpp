// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Conversion between the pixels that a lens shows and those of a rectified image, and the changes in
// rectified images when their camera is refined. Rectified images are always those of one nominal pinhole.
#include <Eigen/Core>
#include <vector>

#include "plumbline/sensor/camera.hpp"

namespace plumbline::sensor {

/// One camera and the pinhole to which its images are rectified.
class ImageModel {
 public:
  ImageModel(const Pinhole& image, const Camera& camera) : image_(image), camera_(camera) {}

  /// Pixel of the distorted image from which a rectified pixel is taken.
  [[nodiscard]] Eigen::Vector2d lens_pixel(const Eigen::Vector2d& rectified) const;
  /// The inverse; Newton's method, exact to 1e-6 px inside the image.
  [[nodiscard]] Eigen::Vector2d rectified_pixel(const Eigen::Vector2d& lens) const;
  /// Depth (metres, > 0) at a rectified pixel as the depth camera measured it, without its slope taken out.
  [[nodiscard]] double measured_depth(const Eigen::Vector2d& rectified, double depth) const;
  /// The inverse. 0 if the point would lie behind the camera.
  [[nodiscard]] double true_depth(const Eigen::Vector2d& rectified, double measured) const;

  [[nodiscard]] const Pinhole& image() const { return image_; }
  [[nodiscard]] const Camera& camera() const { return camera_; }

 private:
  [[nodiscard]] double slope_at(const Eigen::Vector2d& rectified) const;
  Pinhole image_;
  Camera camera_;
};

/// Change of a camera's calibration, from `before` to `after`, for images of one pinhole. Const methods are
/// thread-safe.
class Recalibration {
 public:
  Recalibration(const Pinhole& image, const Camera& before, const Camera& after);

  [[nodiscard]] const ImageModel& before() const { return before_; }
  [[nodiscard]] const ImageModel& after() const { return after_; }
  /// New position of a rectified pixel's content, interpolated in a table to a few thousandths of a pixel.
  [[nodiscard]] Eigen::Vector2d pixel(const Eigen::Vector2d& rectified) const;
  /// New depth of a pixel that had the depth z (> 0) at `before` and is now at `now`; 0 if none is left.
  [[nodiscard]] double depth(const Eigen::Vector2d& before, const Eigen::Vector2d& now, double z) const;
  /// New position of a point (camera frame, metres, z > 0) that the depth image measured. With a separate
  /// depth camera, the colour camera's lens does not move it.
  [[nodiscard]] Eigen::Vector3d point(const Eigen::Vector3d& p) const;
  /// New normal of the surface there, unit or zero: a slope of depth tilts it.
  [[nodiscard]] Eigen::Vector3d normal(const Eigen::Vector3d& p, const Eigen::Vector3d& normal) const;
  /// Additional delay of depth images relative to `before`, seconds.
  [[nodiscard]] double delay_s() const {
    return after_.camera().depth_delay_s - before_.camera().depth_delay_s;
  }
  /// True if neither pixels nor depths change; shutter and delay may.
  [[nodiscard]] bool keeps_images() const { return !moves_pixels_ && !moves_depth_; }

 private:
  ImageModel before_;
  ImageModel after_;
  bool moves_pixels_ = false;
  bool moves_depth_ = false;
  int columns_ = 0;
  int rows_ = 0;
  std::vector<Eigen::Vector2d> shifts_;  ///< shift of every kCell-th pixel, row by row
};

}  // namespace plumbline::sensor
