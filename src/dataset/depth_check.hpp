// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "plumbline/core/error.hpp"
#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/sensor/camera.hpp"

namespace plumbline::dataset {

/// Looks at the depth of a few frames. The warning where it is in an unlikely unit, "" where it looks like
/// metres. Error (kInput): it cannot be metres, or no frame can be read. `folder`: what messages call the
/// source.
core::Result<std::string> check_depth_scale(const FrameSource& source, const std::string& folder);

/// Error (kInput): no RGB-D camera has such focal lengths; a digit or a point of its file is wrong.
core::Result<void> check_focal_lengths(const sensor::Camera& camera, const std::string& folder);

}  // namespace plumbline::dataset
