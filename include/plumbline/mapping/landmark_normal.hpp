// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Which way the surface under a landmark faces, from the depth image of the keyframe that made it:
// the local cloud, not neighbouring sparse points (docs/method/mapping.md).
#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "plumbline/maps/map.hpp"
#include "plumbline/sensor/camera.hpp"

namespace plumbline::mapping {

/// Look-up of a keyframe's surface samples around a pixel. Keeps a reference to the samples.
class SurfaceNormals {
 public:
  SurfaceNormals(const std::vector<maps::SurfaceSample>& surface, const sensor::Pinhole& camera);

  /// Unit normal (camera frame, towards the camera) at `point` (camera frame, metres): the mean over the
  /// samples within 32 px whose tangent planes pass through the point, within three standard deviations. Zero
  /// when there are fewer than three, or when they do not agree: edges of objects have no one normal.
  [[nodiscard]] Eigen::Vector3d at(const Eigen::Vector3d& point) const;

 private:
  const std::vector<maps::SurfaceSample>& surface_;
  sensor::Pinhole camera_;
  int columns_ = 0;
  int rows_ = 0;
  std::vector<std::vector<int>> cells_;
};

/// The same of every corner with depth, from the depth image (CV_32FC1, metres): the plane that at least half
/// of the pixels within 12 px of `pixel` lie on, those nearest to the corner's depth `z` first. At a fold it
/// is the larger side's. Zero where there is none.
Eigen::Vector3d depth_normal(const cv::Mat& depth, const Eigen::Vector2d& pixel, double z,
                             const sensor::Pinhole& camera);

}  // namespace plumbline::mapping
