// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Rolling shutters read an image out row by row, over some 20 ms; a camera that turns meanwhile shears it.
#include "plumbline/features/frame_features.hpp"
#include "plumbline/sensor/camera.hpp"

namespace plumbline::features {

/// Moves points and lines (and their 3D ends) to where an image taken all at once, when the middle row was
/// read, would show them. `turn_rate`: rad/s in the camera frame, camera_from_world(t + dt) =
/// Exp(turn_rate dt) camera_from_world(t). `readout_s`: from the first row to the last; 0 changes nothing.
/// `camera` is that of the features. Translation is left out: at a metre a walking pace moves less than half
/// a degree does.
void undo_rolling_shutter(FrameFeatures& features, const sensor::Pinhole& camera,
                          const Eigen::Vector3d& turn_rate, double readout_s);

}  // namespace plumbline::features
