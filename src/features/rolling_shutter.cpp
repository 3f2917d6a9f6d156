// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/features/rolling_shutter.hpp"

namespace plumbline::features {

void undo_rolling_shutter(FrameFeatures& features, const sensor::Pinhole& camera,
                          const geometry::Vector6d& velocity, double readout_s) {
  if (readout_s == 0.0 || velocity.isZero(0.0) || camera.height <= 0) return;
  const auto middle_from_row = [&](float v) {
    const double seconds = (static_cast<double>(v) / camera.height - 0.5) * readout_s;
    return geometry::exp_se3(-seconds * velocity);
  };
  const auto moved = [&](const Eigen::Vector2f& pixel, double z) -> Eigen::Vector3d {
    const Eigen::Vector2d p = pixel.cast<double>();
    const geometry::Rigid3 motion = middle_from_row(pixel.y());
    // Without a depth: as if it were far away, which only turns it.
    return z > 0.0 ? motion * camera.unproject(p.x(), p.y(), z)
                   : motion.rotation * camera.unproject(p.x(), p.y(), 1.0);
  };
  for (PointFeature& point : features.points) {
    const Eigen::Vector3d p = moved(point.pixel, static_cast<double>(point.depth));
    point.pixel = camera.project(p).cast<float>();
    if (point.depth > 0.0F) point.depth = static_cast<float>(p.z());
  }
  for (LineFeature& line : features.lines) {
    LineSegment& s = line.segment;
    const auto move_end = [&](Eigen::Vector2f& pixel, Eigen::Vector3d* end) {
      const geometry::Rigid3 motion = middle_from_row(pixel.y());
      pixel = camera.project(moved(pixel, end != nullptr ? end->z() : 0.0)).cast<float>();
      if (end != nullptr) *end = motion * *end;
    };
    move_end(s.start, line.line3 ? &line.line3->start : nullptr);
    move_end(s.end, line.line3 ? &line.line3->end : nullptr);
  }
  features.grid = PointGrid(features.points, camera.width, camera.height);
}

}  // namespace plumbline::features
