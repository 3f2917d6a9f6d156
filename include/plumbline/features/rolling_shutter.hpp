// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Rolling shutters read an image row by row, over some 20 ms; the image is sheared if the camera moves
// meanwhile.
#include "plumbline/features/frame_features.hpp"
#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/sensor/camera.hpp"

namespace plumbline::features {

/// Position of a point of the scene, in the camera's frame, a share of the readout later: while row `v` of an
/// image of `height` rows is read, the share is v / height - 0.5 of the readout after the middle row.
class RowMotion {
 public:
  /// `shutter_motion`: FrameFeatures::shutter_motion. Without depth only the rotation is applied.
  RowMotion(const geometry::Vector6d& shutter_motion, double share, bool has_depth);
  /// The moved point. A point that would come nearer than 5 cm, or behind the camera, is not moved.
  Eigen::Vector3d operator()(const Eigen::Vector3d& p) const;

 private:
  geometry::Rigid3 motion_;
};

/// Moves points and lines (and their 3D ends) to where an image taken all at once, when the middle row was
/// read, would show them. `velocity`: (m/s, rad/s) in the camera frame, camera_from_world(t + dt) =
/// Exp(velocity dt) camera_from_world(t). `readout_s`: from the first row to the last; 0 changes nothing.
/// `camera` is that of the features. Features without depth are only rotated.
void undo_rolling_shutter(FrameFeatures& features, const sensor::Pinhole& camera,
                          const geometry::Vector6d& velocity, double readout_s);

}  // namespace plumbline::features
