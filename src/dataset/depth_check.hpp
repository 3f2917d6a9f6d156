// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "plumbline/core/error.hpp"
#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/sensor/camera.hpp"

namespace plumbline::dataset {

struct ScaleCheck {
  std::string text;      ///< what contradicts the scale, and the scale that would fit; "": nothing
  bool doubted = false;  ///< two signs contradict it
};

/// Looks at the depth of a few frames for signs of a wrong unit: more than a tenth of it beyond the reach of
/// depth cameras, more than a twentieth nearer than the camera can measure, steps of no camera's disparity. A
/// median alone is none: scenes are near or far. Error (kInput): it cannot be metres, or no frame can be
/// read. `folder`: name of the source in messages.
core::Result<ScaleCheck> check_depth_scale(const FrameSource& source, const std::string& folder);

/// Error (kInput): no RGB-D camera has such focal lengths; a digit or a point of its file is wrong.
core::Result<void> check_focal_lengths(const sensor::Camera& camera, const std::string& folder);

}  // namespace plumbline::dataset
