// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The motion between two frames by their surfaces and corners.
#include <Eigen/Core>
#include <array>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "plumbline/geometry/rigid3.hpp"
#include "view.hpp"

namespace plumbline::check {

/// Standard deviation of a depth measurement, metres.
struct DepthNoise {
  double a = 0.0012;
  double b = 0.0019;  ///< 1/m
  [[nodiscard]] double operator()(double z) const { return a + b * z * z; }
};

/// Distance of a point of the first frame from the surface that the second one measured.
struct DepthRow {
  Eigen::Vector3d point;   ///< in the second camera, metres
  Eigen::Vector3d normal;  ///< there, of the second frame's surface
  double off_m = 0.0;      ///< along the normal, of the surface from the point
};

/// Remaining motion of a corner in the second picture.
struct FlowRow {
  Eigen::Vector3d point;
  Eigen::Vector2d off_px;  ///< pixels of the small picture
};

struct PairRows {
  std::vector<DepthRow> depth;
  std::vector<FlowRow> flow;
  std::size_t common = 0;   ///< surface points that fall on a surface of the second picture
  std::size_t through = 0;  ///< those that the second frame looks through
  double found = 1.0;       ///< share of `common` that lies near enough to be compared
  bool meet = false;        ///< so much surface is common that it holds all directions
  /// True if the frames should show the same surface, and do not. Between visits something else may have
  /// come before it, but nobody looks through it.
  [[nodiscard]] bool contradicts(bool revisit) const {
    return common >= kMany && (revisit ? 2 * through > common : 4 * depth.size() < common);
  }

  /// Mean depth of the common surface.
  [[nodiscard]] double distance_m() const;

  static constexpr std::size_t kMany = 600;
};

/// The first frame of pairs, with what is the same for all its partners.
class FirstView {
 public:
  explicit FirstView(View view);
  [[nodiscard]] PairRows depth_rows(const View& second) const;
  void add_flow(const View& second, PairRows& rows);
  [[nodiscard]] const View& view() const { return view_; }

 private:
  struct Sample {
    Eigen::Vector3d point, normal;
  };
  void prepare_flow();
  View view_;
  std::vector<Sample> samples_;
  bool prepared_ = false;
  cv::Mat gray_;  ///< on the grid of depth
  std::vector<cv::Mat> pyramid_;
  std::vector<cv::Point2f> corners_;
};

/// Distance that both cameras moved while the pictures were taken: a pair knows neither when each row was
/// read nor how late depth is, to about 10 ms, and cannot tell such an error from one of the path. RMS a
/// component.
struct Blur {
  double shift_m = 0.0;  ///< with that of surfaces at their distance, which a turn moves alike
  double turn_rad = 0.0;
  [[nodiscard]] geometry::Matrix6d covariance() const;
};
Blur blur_of(const FramePoses& first, const FramePoses& second, double distance_m);

/// Small motion (t, w) of the first frame's points in the second camera that the rows ask for.
struct Correction {
  geometry::Vector6d motion = geometry::Vector6d::Zero();
  geometry::Matrix6d information = geometry::Matrix6d::Zero();  ///< without the prior
  Blur blur;
  /// With the prior of 0.3 m and 0.15 rad.
  [[nodiscard]] geometry::Matrix6d covariance() const;
  /// Length of the shift, less its own noise.
  [[nodiscard]] double shift_m() const;
  /// The same, less what the cameras' motion explains: only this is a sign against the path.
  [[nodiscard]] double unexplained_m() const;
};

enum class Rows { kBoth, kDepth, kFlow };

Correction correction_of(const PairRows& rows, const sensor::Pinhole& second, const DepthNoise& noise,
                         Rows use);

}  // namespace plumbline::check
