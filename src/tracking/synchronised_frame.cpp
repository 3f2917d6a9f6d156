// SPDX-License-Identifier: BSD-3-Clause
// Correction of images whose parts were not taken at the same moment.
#include "alignment/image_motion.hpp"
#include "plumbline/features/depth_delay.hpp"
#include "plumbline/features/rolling_shutter.hpp"
#include "plumbline/tracking/tracker.hpp"

namespace plumbline::tracking {

void Tracker::set_shutter(std::optional<double> readout_s) {
  if (!readout_s) return;
  options_.readout_s = *readout_s;
  global_shutter_ = *readout_s == 0.0;
}

double Tracker::depth_delay_s(const sensor::RgbdFrame& frame) const {
  constexpr double kMost_s = 0.1;  // an image that comes later than that shows another scene
  const double dt = frame.depth_stamp - frame.stamp;
  return options_.align_stamps && std::abs(dt) < kMost_s ? dt : 0.0;
}

std::shared_ptr<const features::FrameFeatures> synchronised(
    const std::shared_ptr<const features::FrameFeatures>& features, const cv::Mat& depth,
    const sensor::Pinhole& camera, const ImageMotion& motion) {
  // Without motion the features need no change
  if (!motion.moves_depth() && motion.shutter.isZero(0.0)) return features;
  auto result = std::make_shared<features::FrameFeatures>(*features);
  if (motion.moves_depth())
    features::undo_point_depth_delay(*result, depth, camera, motion.depth_from_camera);
  features::undo_rolling_shutter(*result, camera, motion.shutter, 1.0);
  return result;
}

}  // namespace plumbline::tracking
