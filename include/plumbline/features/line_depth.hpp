// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A 3D line from the depth under an image segment (docs/method/features.md: wrong lines are removed before
// they are used).
#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <optional>

#include "plumbline/core/options.hpp"
#include "plumbline/features/line_segment.hpp"
#include "plumbline/sensor/camera.hpp"

namespace plumbline::features {

/// Noise of one end of a segment in space. The type is small, since every keyframe keeps two of them for each
/// line.
struct EndpointNoise {
  float depth = 0.0F;   ///< standard deviation along z, metres
  float across = 0.0F;  ///< in x and in y, metres, from pixel noise
};

/// 3D segment in the camera frame, metres. Its image is the measured segment.
struct Line3 {
  Eigen::Vector3d start = Eigen::Vector3d::Zero();
  Eigen::Vector3d end = Eigen::Vector3d::Zero();
  EndpointNoise start_noise;
  EndpointNoise end_noise;
  float inlier_share = 0.0F;  ///< share of inliers among the depth samples along the segment
  float coverage = 0.0F;      ///< share of the segment's length that has supporting depth
};

/// Covariance in m^2 of an end at `end` (camera frame): depth noise along its ray, pixel noise across.
Eigen::Matrix3d endpoint_covariance(const Eigen::Vector3d& end, const EndpointNoise& noise);
/// Root of that covariance's trace, metres.
double endpoint_sigma(const Eigen::Vector3d& end, const EndpointNoise& noise);

struct LineDepthOptions {
  int samples = 40;  ///< places along the segment, at most
  int side_px = 4;   ///< distance beside the segment within which depth is searched
  double max_depth_m = 8.0;
  double inlier_sigmas = 3.0;  ///< gate in units of the depth noise
  double min_inlier_share = 0.6;
  double min_coverage = 0.5;
  int min_inliers = 8;
  int ransac_rounds = 24;
  double pixel_sigma = 0.7;  ///< px, across the segment, for the endpoints' noise

  void declare(core::OptionTable& table);
};

/// 3D line of `segment` from `depth_m` (CV_32FC1, metres along z, 0 or NaN = none, same pinhole as the
/// segment). At a depth jump the foreground side is taken, since an occluding edge belongs to the foreground.
/// None if depth does not support one 3D line. Deterministic: the same input gives the same bytes.
std::optional<Line3> fit_line_depth(const LineSegment& segment, const cv::Mat& depth_m,
                                    const sensor::Pinhole& camera, const LineDepthOptions& options = {});

}  // namespace plumbline::features
