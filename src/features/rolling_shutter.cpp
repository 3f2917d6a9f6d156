// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/features/rolling_shutter.hpp"

#include "plumbline/geometry/rigid3.hpp"

namespace plumbline::features {

void undo_rolling_shutter(FrameFeatures& features, const sensor::Pinhole& camera,
                          const Eigen::Vector3d& turn_rate, double readout_s) {
  if (readout_s == 0.0 || turn_rate.isZero(0.0) || camera.height <= 0) return;
  // A ray of row v was seen at (v / height - 1/2) readout_s; the turn back to 0 is small, but exact is as
  // easy.
  const auto middle_from_row = [&](float v) {
    const double seconds = (static_cast<double>(v) / camera.height - 0.5) * readout_s;
    return geometry::exp_so3(-seconds * turn_rate);
  };
  const auto moved = [&](const Eigen::Vector2f& pixel) -> Eigen::Vector2f {
    const Eigen::Vector3d ray =
        camera.unproject(static_cast<double>(pixel.x()), static_cast<double>(pixel.y()), 1.0);
    return camera.project(middle_from_row(pixel.y()) * ray).cast<float>();
  };
  for (PointFeature& point : features.points) point.pixel = moved(point.pixel);
  for (LineFeature& line : features.lines) {
    LineSegment& s = line.segment;
    if (line.line3) {
      line.line3->start = middle_from_row(s.start.y()) * line.line3->start;
      line.line3->end = middle_from_row(s.end.y()) * line.line3->end;
    }
    s.start = moved(s.start);
    s.end = moved(s.end);
  }
  features.grid = PointGrid(features.points, camera.width, camera.height);
}

}  // namespace plumbline::features
