// SPDX-License-Identifier: BSD-3-Clause
#include "scene/raster.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace plumbline::viz {
namespace {

cv::Vec4b opaque(const Rgb& color) { return {color.r, color.g, color.b, 255}; }

/// The first pixel whose middle is not before `at`.
int first_from(double at) { return static_cast<int>(std::ceil(at - 0.5)); }

}  // namespace

Raster::Raster(int width, int rows) : picture_(rows, width), depth_(rows, width) {}

void Raster::clear(int first_row, const Rgb& background) {
  first_row_ = first_row;
  std::fill(picture_[0], picture_[0] + picture_.total(), opaque(background));
  std::fill(depth_[0], depth_[0] + depth_.total(), std::numeric_limits<float>::infinity());
}

/// Pixels [first, last) of a row of the picture, where nothing nearer is.
void Raster::fill(int row, int first, int last, float depth, const cv::Vec4b& color) {
  if (row < first_row_ || row >= first_row_ + depth_.rows) return;
  float* depths = depth_.ptr<float>(row - first_row_);
  cv::Vec4b* colors = picture_[row - first_row_];
  for (int x = std::max(first, 0); x < std::min(last, depth_.cols); ++x) {
    if (depth >= depths[x]) continue;
    depths[x] = depth;
    colors[x] = color;
  }
}

void Raster::draw_point(const Eigen::Vector3d& at, double diameter_px, const Rgb& color) {
  const double radius = 0.5 * diameter_px;
  if (!(std::abs(at.x()) < 1e6 && at.y() + radius > first_row_ &&
        at.y() - radius < first_row_ + depth_.rows)) {
    return;
  }

  // The disc, row by row.
  const int end = first_from(at.y() + radius);
  for (int row = first_from(at.y() - radius); row < end; ++row) {
    const double up = row + 0.5 - at.y();
    const double half = std::sqrt(std::max(0.0, radius * radius - up * up));
    fill(row, first_from(at.x() - half), first_from(at.x() + half), static_cast<float>(at.z()),
         opaque(color));
  }
}

void Raster::draw_line(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double width_px,
                       bool perspective, const Rgb& color) {
  const Eigen::Vector2d along = (to - from).head<2>();
  const double length = along.norm();
  if (!(length > 0.0 && length < 1e6)) return;

  const double half = 0.5 * width_px;
  const Eigen::Vector2d unit = along / length;
  const int top = std::min(first_from(std::max(from.y(), to.y()) + half), first_row_ + depth_.rows);

  for (int row = std::max(first_from(std::min(from.y(), to.y()) - half), first_row_); row < top; ++row) {
    // Interval in which the row crosses the rectangle: between both sides, and between both ends.
    const double up = row + 0.5 - from.y();

    double first = std::min(from.x(), to.x()) - half, last = std::max(from.x(), to.x()) + half;
    const auto limit = [&](double slope, double offset, double low, double high) {
      if (std::abs(slope) < 1e-9) return;  // the bounding box limits it
      double a = (low - offset) / slope, b = (high - offset) / slope;
      if (a > b) std::swap(a, b);
      first = std::max(first, from.x() + a);
      last = std::min(last, from.x() + b);
    };

    // Sides, then ends of the rectangle.
    limit(unit.y(), -up * unit.x(), -half, half);
    limit(unit.x(), up * unit.y(), 0.0, length);
    for (int x = std::max(first_from(first), 0); x < std::min(first_from(last), depth_.cols); ++x) {
      const double share = std::clamp((unit.x() * (x + 0.5 - from.x()) + unit.y() * up) / length, 0.0, 1.0);
      const double depth = perspective ? 1.0 / ((1.0 - share) / from.z() + share / to.z())
                                       : (1.0 - share) * from.z() + share * to.z();
      fill(row, x, x + 1, static_cast<float>(depth), opaque(color));
    }
  }
}

}  // namespace plumbline::viz
