// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Conversion of an RGB-D frame into an organised cloud with colours and normals.
#include "plumbline/cloud/types.hpp"
#include "plumbline/core/options.hpp"
#include "plumbline/sensor/camera.hpp"
#include "plumbline/sensor/frame.hpp"

namespace plumbline::cloud {

struct KeyframeCloudOptions {
  int stride_px = 0;         ///< one point per stride x stride pixels; 0: chosen by the image's width
  double min_depth_m = 0.2;  ///< measurements outside [min, max] are left out
  double max_depth_m = 8.0;
  int smooth_px = 7;            ///< window of the edge-aware mean before differences are taken, odd
  bool smooth_position = true;  ///< take positions from the mean, not from the single measurement
  double base_px = 12.0;  ///< half base of the differences at 2 m; grows and shrinks with sigma_z(z) / z

  void declare(core::OptionTable& table);
  /// The stride in an image of that width in pixels: `stride_px`, or if that is 0 one that leaves about as
  /// many points as 2 does in an image of 640 x 480: 2 up to 1100 px, 3 for 1280, 4 for 1920. Voxels average
  /// over several points in any case; more of them cost time and make the cloud no better.
  [[nodiscard]] int stride(int width) const;
};

/// Organised cloud of width / stride by height / stride points (rounded up) in the camera frame: point (i, j)
/// is the measurement of pixel (stride i, stride j), or NaN without one. Positions lie on the pixel's ray at
/// the raw depth or, with `smooth_position`, at the mean of the neighbours that lie on one plane, which
/// leaves a half to a sixth of the noise. `curvature` is the bend of the surface across the base in radians.
/// `frame.depth`: CV_32FC1 of the camera's size; `frame.color`: BGR of the same size (may be empty: white).
///
/// Normals: on a plane the inverse depth is linear in the pixel, 1/z = a x + b y + c with normal ~ (a, b, c)
/// and x = (u - cx) / fx, so the normal is the gradient of the smoothed inverse depth. Differences span a
/// wide base (over a narrow one, raw structured-light depth hardly differs), never cross a depth jump, and
/// become one-sided at jumps and creases, so that surfaces keep their normal up to their border. NaN where
/// too little of the surface is seen.
CloudPtr organised_cloud(const sensor::RgbdFrame& frame, const sensor::Pinhole& camera,
                         const KeyframeCloudOptions& options = {});

}  // namespace plumbline::cloud
