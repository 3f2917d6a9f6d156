// SPDX-License-Identifier: BSD-3-Clause
// What the tracker does about images whose parts were not taken at the same moment.
#include "frame_aligner.hpp"
#include "plumbline/features/depth_delay.hpp"
#include "plumbline/features/rolling_shutter.hpp"

namespace plumbline::tracking {

using geometry::Rigid3;

void Tracker::set_shutter(std::optional<double> readout_s) {
  if (options_.readout_s > 0.0 || !readout_s) return;
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
                                        const Eigen::Vector3d& angular_velocity) const {
  const Rigid3 to_depth = depth_from_camera(frame);
  const bool distorted = options_.readout_s != 0.0 && !angular_velocity.isZero(0.0);
  const bool delayed = !to_depth.translation.isZero(0.0) || !to_depth.rotation.isIdentity(0.0);
  if (!distorted && !delayed) return features;
  auto result = std::make_shared<features::FrameFeatures>(*features);
  if (delayed) features::undo_point_depth_delay(*result, frame.depth, camera_, to_depth);
  if (distorted) features::undo_rolling_shutter(*result, camera_, angular_velocity, options_.readout_s);
  return result;
}

/// The motion model lags behind a turn that changes. Now that the pose is known, so is the turn: where the
/// difference can be seen, the pose is estimated once more.
void Tracker::refine_rolling_shutter(const maps::Map& map, const sensor::RgbdFrame& frame,
                                     const Features& features, TrackResult& result) const {
  constexpr double kVisible_px = 1.0;  // at the first and the last row
  const double dt = frame.stamp - motion_.last_stamp();
  if (options_.readout_s == 0.0 || !motion_.continuous() || dt < 1e-4 || dt > 0.5) return;
  const Eigen::Vector3d mean =
      geometry::log_so3((result.camera_from_world * motion_.camera_from_world().inverse()).rotation) / dt;
  // Both are means of their steps: half a step on.
  const Eigen::Vector3d before = motion_.angular_velocity();
  const Eigen::Vector3d now = before.isZero(0.0) ? mean : Eigen::Vector3d(mean + 0.5 * (mean - before));
  if ((now - before).norm() * 0.5 * options_.readout_s * camera_.fx < kVisible_px) return;
  const Features synced = synchronised(frame, features, now);
  TrackResult again = align(map, frame, *synced, result.camera_from_world, kFineRadius_px);
  if (again.state != TrackState::kTracked) return;
  again.relocalised = result.relocalised;
  again.features = synced;
  result = std::move(again);
}

}  // namespace plumbline::tracking
