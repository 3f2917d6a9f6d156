// SPDX-License-Identifier: BSD-3-Clause
#include "view.hpp"

#include <algorithm>
#include <cmath>

namespace plumbline::check {

using geometry::Rigid3;

SmallCamera::SmallCamera(const Way& way)
    : full_(way.camera),
      size_(small_size(way.camera)),
      small_(way.camera.resized(size_.width, size_.height)),
      step_x_(static_cast<double>(full_.width) / size_.width),
      step_y_(static_cast<double>(full_.height) / size_.height),
      readout_s_(way.readout_s) {
  for (int x = 0; x < size_.width; ++x)
    x_.push_back(static_cast<float>((grid_pixel(x, full_.width, size_.width) - full_.cx) / full_.fx));
  for (int y = 0; y < size_.height; ++y)
    y_.push_back(static_cast<float>((grid_pixel(y, full_.height, size_.height) - full_.cy) / full_.fy));
}

bool has_pose(const geometry::Trajectory& path, double stamp, double max_dt_s) {
  const auto after =
      std::lower_bound(path.begin(), path.end(), stamp,
                       [](const geometry::StampedPose& pose, double s) { return pose.stamp < s; });
  return (after != path.end() && after->stamp - stamp <= max_dt_s) ||
         (after != path.begin() && stamp - (after - 1)->stamp <= max_dt_s);
}

std::optional<Rigid3> PathPoses::at(double stamp) const {
  if (path_.size() < 2) return std::nullopt;
  const auto after =
      std::upper_bound(path_.begin() + 1, path_.end() - 1, stamp,
                       [](double s, const geometry::StampedPose& pose) { return s < pose.stamp; });
  const geometry::StampedPose& a = *(after - 1);
  const geometry::StampedPose& b = *after;

  constexpr double kGap_s = 0.2;
  constexpr double kInto_s = 0.02;
  const double gap = b.stamp - a.stamp;
  if (!(gap > 0.0)) return a.world_from_camera;
  if (gap > kGap_s && stamp - a.stamp > kInto_s && b.stamp - stamp > kInto_s) return std::nullopt;

  const double share = (stamp - a.stamp) / gap;
  if (share < -2.0 || share > 3.0) return std::nullopt;
  return geometry::interpolate(a.world_from_camera, b.world_from_camera, share);
}

std::optional<FramePoses> PathPoses::of(const KeptFrame& frame) const {
  if (!has_pose(path_, frame.stamp, max_dt_s_)) return std::nullopt;
  const auto color = at(frame.stamp);
  const auto depth = at(frame.depth_stamp);
  if (!color || !depth) return std::nullopt;
  FramePoses poses{*depth, *color};

  constexpr double kSpan_s = 0.02;
  const auto before = at(frame.stamp - 0.5 * kSpan_s);
  const auto later = at(frame.stamp + 0.5 * kSpan_s);
  if (before && later) {
    const Rigid3 step = before->inverse() * *later;
    poses.velocity = step.translation / kSpan_s;
    poses.turn = geometry::log_so3(step.rotation) / kSpan_s;
  }
  return poses;
}

std::optional<Eigen::Vector3d> View::normal(const cv::Point& at) const {
  constexpr int kReach = 3;
  constexpr double kLeastCosine = 0.3;
  const cv::Size& size = camera->size();
  if (at.x < kReach || at.y < kReach || at.x >= size.width - kReach || at.y >= size.height - kReach)
    return std::nullopt;

  // No surface goes on across a border of depth.
  const cv::Point left(at.x - kReach, at.y), right(at.x + kReach, at.y);
  const cv::Point above(at.x, at.y - kReach), below(at.x, at.y + kReach);
  const double middle = z(at);
  const double l = z(left), r = z(right), a = z(above), b = z(below);
  if (middle <= 0.0 || l <= 0.0 || r <= 0.0 || a <= 0.0 || b <= 0.0) return std::nullopt;
  const double bend = std::max(std::abs(l + r - 2.0 * middle), std::abs(a + b - 2.0 * middle));
  if (bend >= 0.01 * middle + 0.006 * middle * middle) return std::nullopt;

  const Eigen::Vector3d across = r * camera->ray(right) - l * camera->ray(left);
  const Eigen::Vector3d down = b * camera->ray(below) - a * camera->ray(above);
  Eigen::Vector3d normal = down.cross(across);
  const double length = normal.norm();
  if (length <= 0.0) return std::nullopt;
  normal /= length;
  const Eigen::Vector3d ray = camera->ray(at);
  const double cosine = -normal.dot(ray) / ray.norm();
  if (std::abs(cosine) <= kLeastCosine) return std::nullopt;
  return cosine > 0.0 ? normal : Eigen::Vector3d(-normal);
}

}  // namespace plumbline::check
