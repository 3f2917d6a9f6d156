// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Which way the surface under a landmark faces, from the depth image of the keyframe that made it:
// the local cloud, not neighbouring sparse points (docs/method/mapping.md).
#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "plumbline/sensor/camera.hpp"

namespace plumbline::mapping {

/// Unit normal (camera frame, towards the camera) of the surface at a corner, from the depth image (CV_32FC1,
/// metres): of the plane that at least half of the pixels within 12 px of `pixel` lie on, those nearest to
/// the corner's depth `z` first. At a fold it is the larger side's. Zero where there is none.
Eigen::Vector3d depth_normal(const cv::Mat& depth, const Eigen::Vector2d& pixel, double z,
                             const sensor::Pinhole& camera);

}  // namespace plumbline::mapping
