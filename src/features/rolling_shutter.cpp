// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/features/rolling_shutter.hpp"

namespace plumbline::features {

RowMotion::RowMotion(const geometry::Vector6d& shutter_motion, double share, bool has_depth)
    : motion_(geometry::exp_se3(share * shutter_motion)) {
  if (!has_depth) motion_.translation.setZero();
}

Eigen::Vector3d RowMotion::operator()(const Eigen::Vector3d& p) const {
  constexpr double kNearest_m = 0.05;
  const Eigen::Vector3d moved = motion_ * p;
  return moved.z() > kNearest_m ? moved : p;
}

void undo_rolling_shutter(FrameFeatures& features, const sensor::Pinhole& camera,
                          const geometry::Vector6d& velocity, double readout_s) {
  if (readout_s == 0.0 || velocity.isZero(0.0) || camera.height <= 0) return;
  const geometry::Vector6d motion = readout_s * velocity;
  features.shutter_motion += motion;

  // Position, when the middle row is read, of the point that was at `from` when row `v` was read.
  const auto moved = [&](float v, const Eigen::Vector3d& from, bool has_depth) {
    const double share = static_cast<double>(v) / camera.height - 0.5;
    return RowMotion(motion, -share, has_depth)(from);
  };

  const auto ray = [&](const Eigen::Vector2f& pixel, double z) -> Eigen::Vector3d {
    return camera.unproject(static_cast<double>(pixel.x()), static_cast<double>(pixel.y()), z);
  };

  // Points at the time of the middle row
  for (PointFeature& point : features.points) {
    const bool has_depth = point.depth > 0.0F;
    const double z = has_depth ? static_cast<double>(point.depth) : 1.0;
    const Eigen::Vector3d p = moved(point.pixel.y(), ray(point.pixel, z), has_depth);
    point.pixel = camera.project(p).cast<float>();
    if (has_depth) point.depth = static_cast<float>(p.z());
  }

  // Ends of lines likewise
  for (LineFeature& line : features.lines) {
    const auto move_end = [&](Eigen::Vector2f& pixel, Eigen::Vector3d* end) {
      const float v = pixel.y();
      pixel =
          camera.project(moved(v, ray(pixel, end != nullptr ? end->z() : 1.0), end != nullptr)).cast<float>();
      if (end != nullptr) *end = moved(v, *end, true);
    };

    move_end(line.segment.start, line.line3 ? &line.line3->start : nullptr);
    move_end(line.segment.end, line.line3 ? &line.line3->end : nullptr);
  }

  features.grid = PointGrid(features.points, camera.width, camera.height);
}

}  // namespace plumbline::features
