// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Errors of a camera file.
#include <cstdint>

#include "plumbline/sensor/camera.hpp"
#include "plumbline/synth/options.hpp"

namespace plumbline::synth {

/// Differences of the file from the truth.
struct CameraError {
  double fx = 0.0;            ///< share of both focal lengths
  double fy = 0.0;            ///< share of fy, on top of that
  double cx = 0.0, cy = 0.0;  ///< px
  double k1 = 0.0, k2 = 0.0, p1 = 0.0, p2 = 0.0, k3 = 0.0;
  double slope = 0.0, slope_y = 0.0;  ///< 1/m, of depth along x and y
  double readout = 0.0, delay = 0.0;  ///< s

  [[nodiscard]] sensor::Camera applied(const sensor::Camera& truth) const;
};

/// Reads SynthOptions::camera_error. A seed draws another error for each robot, for pictures of that width.
core::Result<CameraError> camera_error(const std::string& text, int robot, int width);

/// The camera that a recording's file describes. Errors (kUsage): the option cannot be read, or no such
/// camera can be.
core::Result<sensor::Camera> told_camera(const SynthOptions& options, int robot, const sensor::Camera& truth);

}  // namespace plumbline::synth
