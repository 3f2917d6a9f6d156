// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Points at depth jumps: at the border of an object a pixel sees foreground and background at once, and its
// depth lies between them in the air. (pcl::ShadowPoints tests the incidence and loses the organisation.)
#include <pcl/exceptions.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "plumbline/cloud/filters/choosing_filter.hpp"
#include "plumbline/sensor/depth_noise.hpp"

namespace plumbline::cloud {

/// Removes both of two neighbouring points whose distance along the ray is more than the depth noise and the
/// steepest allowed surface explain, and points that few neighbours share a surface with. A method of this
/// program's own over the sensor's noise (docs/method/features.md); one pass over the image.
///
/// For organised clouds, metres; filter() throws pcl::UnorganizedPointCloudException for others that have
/// points. Neighbours are searched among all points, with or without indices.
template <typename PointT>
class FlyingPixels : public ChoosingFilter<PointT> {
 public:
  explicit FlyingPixels(bool extract_removed_indices = false)
      : ChoosingFilter<PointT>(extract_removed_indices) {
    this->filter_name_ = "FlyingPixels";
  }

  /// Position of the camera in the cloud's frame; without it the cloud's sensor_origin_.
  void setViewpoint(const Eigen::Vector3f& viewpoint) { viewpoint_ = viewpoint; }
  /// A jump is more than this many standard deviations of the depth, > 0.
  void setSigmas(double sigmas) { sigmas_ = sigmas; }
  /// Surfaces up to this angle from face on may be that steep, radians in (0, pi / 2).
  void setMaxAngle(double max_angle_rad) { max_angle_rad_ = max_angle_rad; }
  /// Number of further cells to remove on both sides of a jump, >= 0.
  void setMargin(int margin) { margin_ = margin; }
  /// Remove points with fewer of their 8 neighbours on the same surface, 0 to 8.
  void setMinNeighbours(int min_neighbours) { min_neighbours_ = min_neighbours; }

 protected:
  using ChoosingFilter<PointT>::applyFilter;

  void applyFilter(pcl::Indices& indices) override {
    if (!this->input_->empty() && this->input_->height < 2) {
      throw pcl::UnorganizedPointCloudException("FlyingPixels needs an organised cloud");
    }

    // Cells around a jump are removed as well
    Marks marks = mark();
    for (int i = 0; i < margin_; ++i) marks.jump = widened(marks.jump, this->input_->width);
    this->choose(indices,
                 [&](std::size_t i) { return marks.jump[i] == 0 && marks.neighbours[i] >= min_neighbours_; });
  }

 private:
  struct Marks {
    std::vector<std::uint8_t> jump;        ///< 1: at a depth jump
    std::vector<std::uint8_t> neighbours;  ///< number of the 8 neighbours on the same surface
  };
  struct View {
    Eigen::Vector3f ray{0, 0, 1};  ///< unit, from the viewpoint
    float noise = 0.0F;            ///< metres along the ray below which there is no jump
  };

  /// Compares every pair of neighbours once.
  [[nodiscard]] Marks mark() const {
    const pcl::PointCloud<PointT>& cloud = *this->input_;
    const Eigen::Vector3f viewpoint =
        viewpoint_ ? *viewpoint_ : Eigen::Vector3f(cloud.sensor_origin_.template head<3>());
    const std::size_t width = cloud.width;
    Marks marks{std::vector<std::uint8_t>(cloud.size()), std::vector<std::uint8_t>(cloud.size())};
    const auto tangent = static_cast<float>(std::tan(max_angle_rad_));

    // A jump is more than noise and slope explain
    const auto pair = [&](std::size_t a, std::size_t b, const View& view) {
      if (!pcl::isXYZFinite(cloud[b])) return;
      const Eigen::Vector3f difference = cloud[b].getVector3fMap() - cloud[a].getVector3fMap();
      const float along = difference.dot(view.ray);
      const float across = std::sqrt(std::max(0.0F, difference.squaredNorm() - along * along));

      if (std::abs(along) > view.noise + tangent * across) {
        marks.jump[a] = marks.jump[b] = 1;
      } else {
        ++marks.neighbours[a];
        ++marks.neighbours[b];
      }
    };

    for (std::size_t i = 0; i < cloud.size(); ++i) {
      if (!pcl::isXYZFinite(cloud[i])) continue;
      const View view = view_of(cloud[i].getVector3fMap() - viewpoint);
      const std::size_t column = i % width;
      const bool below = i + width < cloud.size();

      // Right, below and two diagonals: every pair once
      if (column + 1 < width) pair(i, i + 1, view);
      if (below) pair(i, i + width, view);
      if (below && column + 1 < width) pair(i, i + width + 1, view);
      if (below && column > 0) pair(i, i + width - 1, view);
    }

    return marks;
  }

  [[nodiscard]] View view_of(const Eigen::Vector3f& offset) const {
    const float range = offset.norm();
    View view;
    if (range > 0.0F) view.ray = offset / range;
    view.noise = static_cast<float>(sigmas_ * sensor::depth_sigma(static_cast<double>(range)));
    return view;
  }

  // Marks the cells left, right, above and below as well.
  static std::vector<std::uint8_t> widened(const std::vector<std::uint8_t>& marks, std::size_t width) {
    std::vector<std::uint8_t> wider = marks;
    for (std::size_t i = 0; i < marks.size(); ++i) {
      if (marks[i] == 0) continue;
      if (i % width > 0) wider[i - 1] = 1;
      if (i % width + 1 < width) wider[i + 1] = 1;
      if (i >= width) wider[i - width] = 1;
      if (i + width < marks.size()) wider[i + width] = 1;
    }
    return wider;
  }

  std::optional<Eigen::Vector3f> viewpoint_;
  double sigmas_ = 4.0;
  double max_angle_rad_ = 1.36;
  int margin_ = 0;
  int min_neighbours_ = 3;
};

}  // namespace plumbline::cloud
