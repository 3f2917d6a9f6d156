// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/sensor/recalibration.hpp"

#include <algorithm>
#include <cmath>

namespace plumbline::sensor {
namespace {

constexpr int kCell = 4;  // px between nodes of the table

bool same(const Pinhole& a, const Pinhole& b) {
  return a.fx == b.fx && a.fy == b.fy && a.cx == b.cx && a.cy == b.cy;
}

}  // namespace

Eigen::Vector2d ImageModel::lens_pixel(const Eigen::Vector2d& rectified) const {
  if (!camera_.distorted() && same(camera_.color, image_)) return rectified;
  const Eigen::Vector2d ray = image_.unproject(rectified.x(), rectified.y(), 1.0).head<2>();
  const Eigen::Vector2d d = camera_.lens().distort(ray);
  return {camera_.color.fx * d.x() + camera_.color.cx, camera_.color.fy * d.y() + camera_.color.cy};
}

Eigen::Vector2d ImageModel::rectified_pixel(const Eigen::Vector2d& lens) const {
  if (!camera_.distorted() && same(camera_.color, image_)) return lens;
  const Eigen::Vector2d distorted = camera_.color.unproject(lens.x(), lens.y(), 1.0).head<2>();
  const Eigen::Vector2d ray = camera_.lens().undistort(distorted);
  return {image_.fx * ray.x() + image_.cx, image_.fy * ray.y() + image_.cy};
}

double ImageModel::slope_at(const Eigen::Vector2d& rectified) const {
  const std::array<double, 2>& slope = camera_.depth_slope;
  return slope[0] * (rectified.x() - image_.cx) / image_.fx +
         slope[1] * (rectified.y() - image_.cy) / image_.fy;
}

double ImageModel::measured_depth(const Eigen::Vector2d& rectified, double depth) const {
  return depth / (1.0 - depth * slope_at(rectified));
}

double ImageModel::true_depth(const Eigen::Vector2d& rectified, double measured) const {
  const double shrink = 1.0 + measured * slope_at(rectified);
  return shrink > 0.1 ? measured / shrink : 0.0;
}

/// Shifts of pixels on a coarse grid; none if the lens stays.
Recalibration::Recalibration(const Pinhole& image, const Camera& before, const Camera& after)
    : before_(image, before), after_(image, after) {
  moves_pixels_ = before.lens() != after.lens() || !same(before.color, after.color);
  moves_depth_ = before.depth_slope != after.depth_slope || before.depth_scale != after.depth_scale ||
                 (moves_pixels_ && !(before.color_from_depth && before.depth));
  if (!moves_pixels_) return;

  // The grid reaches beyond the image's far sides
  columns_ = image.width / kCell + 2;
  rows_ = image.height / kCell + 2;
  shifts_.reserve(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_));
  for (int r = 0; r < rows_; ++r) {
    for (int c = 0; c < columns_; ++c) {
      const Eigen::Vector2d from(kCell * c, kCell * r);
      shifts_.push_back(after_.rectified_pixel(before_.lens_pixel(from)) - from);
    }
  }
}

/// Bilinear interpolation of the grid's shifts.
Eigen::Vector2d Recalibration::pixel(const Eigen::Vector2d& rectified) const {
  if (!moves_pixels_) return rectified;
  const double x = std::clamp(rectified.x() / kCell, 0.0, columns_ - 1.0);
  const double y = std::clamp(rectified.y() / kCell, 0.0, rows_ - 1.0);
  const int c = std::min(static_cast<int>(x), columns_ - 2);
  const int r = std::min(static_cast<int>(y), rows_ - 2);
  const auto at = [&](int i, int j) -> const Eigen::Vector2d& {
    return shifts_[static_cast<std::size_t>(j) * static_cast<std::size_t>(columns_) +
                   static_cast<std::size_t>(i)];
  };
  const double s = x - c;
  const double t = y - r;
  return rectified + (1.0 - t) * ((1.0 - s) * at(c, r) + s * at(c + 1, r)) +
         t * ((1.0 - s) * at(c, r + 1) + s * at(c + 1, r + 1));
}

double Recalibration::depth(const Eigen::Vector2d& before, const Eigen::Vector2d& now, double z) const {
  if (!moves_depth_) return z;
  const double longer = before_.camera().depth_scale / after_.camera().depth_scale;
  return after_.true_depth(now, longer * before_.measured_depth(before, z));
}

/// The pixel moves with the lens, the depth with the slope.
Eigen::Vector3d Recalibration::point(const Eigen::Vector3d& p) const {
  if (!moves_depth_ || !(p.z() > 0.0)) return p;
  const Pinhole& image = before_.image();
  const Eigen::Vector2d then = image.project(p);
  const bool own_depth_camera = before_.camera().color_from_depth && before_.camera().depth;
  const Eigen::Vector2d now = own_depth_camera ? then : pixel(then);
  const double z = depth(then, now, p.z());
  return z > 0.0 ? image.unproject(now.x(), now.y(), z) : p;
}

/// On a plane normal . p = d the inverse depth is linear in the ray, 1/z = normal . (x, y, 1) / d, so that
/// a slope added to 1/z is added to normal / d.
Eigen::Vector3d Recalibration::normal(const Eigen::Vector3d& p, const Eigen::Vector3d& normal) const {
  const double d = normal.dot(p);
  if (!moves_depth_ || std::abs(d) < 1e-3) return normal;
  const std::array<double, 2>& then = before_.camera().depth_slope;
  const std::array<double, 2>& now = after_.camera().depth_slope;
  const double longer = before_.camera().depth_scale / after_.camera().depth_scale;
  const Eigen::Vector3d tilted =
      normal / (longer * d) + Eigen::Vector3d(now[0] - then[0], now[1] - then[1], 0.0);
  return (d > 0.0 ? tilted : Eigen::Vector3d(-tilted)).normalized();
}

}  // namespace plumbline::sensor
