// SPDX-License-Identifier: BSD-3-Clause
// What the tracker does about pictures whose parts were not taken at the same moment.
#include "plumbline/features/depth_delay.hpp"
#include "plumbline/features/rolling_shutter.hpp"
#include "plumbline/tracking/tracker.hpp"

namespace plumbline::tracking {

using geometry::Rigid3;

/// Features as if all rows of the picture, and the depth image, had been taken at the colour image's stamp.
Tracker::Features Tracker::synchronised(const sensor::RgbdFrame& frame, const Features& features,
                                        const Eigen::Vector3d& turn_rate) const {
  const Rigid3 to_depth = depth_from_camera(frame);
  const bool distorted = options_.readout_s != 0.0 && !turn_rate.isZero(0.0);
  const bool delayed = !to_depth.translation.isZero(0.0) || !to_depth.rotation.isIdentity(0.0);
  if (!distorted && !delayed) return features;
  auto still = std::make_shared<features::FrameFeatures>(*features);
  if (delayed) features::undo_point_depth_delay(*still, frame.depth, camera_, to_depth);
  if (distorted) features::undo_rolling_shutter(*still, camera_, turn_rate, options_.readout_s);
  return still;
}

}  // namespace plumbline::tracking
