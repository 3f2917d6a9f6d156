// SPDX-License-Identifier: BSD-3-Clause
// Correction of images whose parts were not taken at the same moment.
#include "plumbline/features/depth_delay.hpp"
#include "plumbline/features/rolling_shutter.hpp"
#include "plumbline/tracking/tracker.hpp"

namespace plumbline::tracking {

using geometry::Rigid3;

void Tracker::set_shutter(std::optional<double> readout_s) {
  if (!readout_s) return;
  options_.readout_s = *readout_s;
  global_shutter_ = *readout_s == 0.0;
}

Rigid3 Tracker::depth_from_camera(const sensor::RgbdFrame& frame) const {
  const double dt = frame.depth_stamp - frame.stamp;
  if (!options_.align_stamps || std::abs(dt) > 0.05) return {};
  return motion_.motion_within(dt);
}

/// Features as if all rows of the image, and the depth image, had been taken at the colour image's stamp.
Tracker::Features Tracker::synchronised(const sensor::RgbdFrame& frame, const Features& features,
                                        const geometry::Vector6d& velocity) const {
  const Rigid3 to_depth = depth_from_camera(frame);
  const bool distorted = options_.readout_s != 0.0 && !velocity.isZero(0.0);
  const bool delayed = !to_depth.translation.isZero(0.0) || !to_depth.rotation.isIdentity(0.0);
  if (!distorted && !delayed) return features;
  auto result = std::make_shared<features::FrameFeatures>(*features);
  if (delayed) features::undo_point_depth_delay(*result, frame.depth, camera_, to_depth);
  if (distorted) features::undo_rolling_shutter(*result, camera_, velocity, options_.readout_s);
  return result;
}

}  // namespace plumbline::tracking
