// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A kept frame at its place on the path.
#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "plumbline/check/self_check.hpp"
#include "plumbline/geometry/rigid3.hpp"

namespace plumbline::check {

/// Pixels of small pictures and their rays, of one way.
class SmallCamera {
 public:
  explicit SmallCamera(const Way& way);

  /// Grid point of depth that a point of the camera's frame falls on; none outside.
  [[nodiscard]] std::optional<cv::Point> grid_point(const Eigen::Vector3d& p) const {
    if (p.z() < kNearest_m) return std::nullopt;
    const double u = (full_.fx * p.x() / p.z() + full_.cx + 0.5) / step_x_;
    const double v = (full_.fy * p.y() / p.z() + full_.cy + 0.5) / step_y_;
    if (!(u >= 0.0 && v >= 0.0 && u < size_.width && v < size_.height)) return std::nullopt;
    return cv::Point(static_cast<int>(u), static_cast<int>(v));
  }
  /// Ray of a grid point of depth, z = 1.
  [[nodiscard]] Eigen::Vector3d ray(const cv::Point& at) const {
    return {x_[static_cast<std::size_t>(at.x)], y_[static_cast<std::size_t>(at.y)], 1.0};
  }
  [[nodiscard]] const std::vector<float>& columns() const { return x_; }
  [[nodiscard]] const std::vector<float>& rows() const { return y_; }
  [[nodiscard]] const sensor::Pinhole& pinhole() const { return small_; }  ///< of the small picture
  [[nodiscard]] const cv::Size& size() const { return size_; }
  [[nodiscard]] double readout_s() const { return readout_s_; }

  static constexpr double kNearest_m = 0.1;

 private:
  sensor::Pinhole full_;
  cv::Size size_;
  sensor::Pinhole small_;
  double step_x_, step_y_;
  double readout_s_;
  std::vector<float> x_, y_;
};

/// Poses at which a frame's images were taken.
struct FramePoses {
  geometry::Rigid3 world_from_depth;
  geometry::Rigid3 world_from_color;
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< m/s, of the colour camera, in its own frame
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();      ///< rad/s
};

/// The path of a way between its poses.
class PathPoses {
 public:
  PathPoses(const geometry::Trajectory& path, double max_dt_s) : path_(path), max_dt_s_(max_dt_s) {}
  /// None if the path has no pose near the frame.
  [[nodiscard]] std::optional<FramePoses> of(const KeptFrame& frame) const;

 private:
  /// Interpolated, and continued a little beyond the ends and into gaps.
  [[nodiscard]] std::optional<geometry::Rigid3> at(double stamp) const;
  const geometry::Trajectory& path_;
  double max_dt_s_;
};

struct View {
  const SmallCamera* camera = nullptr;
  FramePoses poses;
  SmallFrame frame;

  [[nodiscard]] double z(const cv::Point& at) const {
    return frame.depth.at<std::uint16_t>(at) / kDepthUnits_per_m;
  }
  [[nodiscard]] Eigen::Vector3d point(const cv::Point& at) const { return z(at) * camera->ray(at); }
  /// Unit normal of the surface there, towards the camera; none at borders of depth, and where the surface is
  /// seen too slantwise.
  [[nodiscard]] std::optional<Eigen::Vector3d> normal(const cv::Point& at) const;
};

}  // namespace plumbline::check
