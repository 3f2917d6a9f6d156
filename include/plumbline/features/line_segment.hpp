// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A straight edge of an image.
#include <Eigen/Core>
#include <cmath>

namespace plumbline::features {

/// Directed segment, full-resolution pixels; (0, 0) is the centre of the top-left pixel. The direction
/// start -> end has the darker side on its right hand as seen in the image (x right, y down), i.e. the
/// gradient g along the edge satisfies cross(end - start, g) = dx gy - dy gx < 0. So lines of two views that
/// match also agree in direction.
struct LineSegment {
  Eigen::Vector2f start{0.0F, 0.0F};
  Eigen::Vector2f end{0.0F, 0.0F};
  float response = 0.0F;  ///< mean gradient across the line, grey levels per pixel, > 0

  [[nodiscard]] Eigen::Vector2f direction() const {
    const Eigen::Vector2f d = end - start;
    const float n = d.norm();
    return n > 0.0F ? Eigen::Vector2f(d / n) : Eigen::Vector2f(1.0F, 0.0F);
  }
  [[nodiscard]] Eigen::Vector2f middle() const { return 0.5F * (start + end); }
  [[nodiscard]] float length() const { return (end - start).norm(); }
  [[nodiscard]] float angle() const {
    return std::atan2(end.y() - start.y(), end.x() - start.x());
  }  ///< radians
};

}  // namespace plumbline::features
