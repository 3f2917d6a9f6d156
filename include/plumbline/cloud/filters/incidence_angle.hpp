// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Points that were seen at a grazing angle: depth there is noisy and biased.
#include <Eigen/Core>
#include <cmath>
#include <optional>

#include "plumbline/cloud/filters/choosing_filter.hpp"

namespace plumbline::cloud {

/// Keeps points whose normal is within an angle of the ray to the viewpoint, for either side of the surface.
/// `PointT` has unit normals; the cloud may be organised or not.
template <typename PointT>
class IncidenceAngle : public ChoosingFilter<PointT> {
 public:
  explicit IncidenceAngle(bool extract_removed_indices = false)
      : ChoosingFilter<PointT>(extract_removed_indices) {
    this->filter_name_ = "IncidenceAngle";
  }

  /// Position of the camera in the cloud's frame; without it the cloud's sensor_origin_.
  void setViewpoint(const Eigen::Vector3f& viewpoint) { viewpoint_ = viewpoint; }
  /// Radians in [0, pi / 2].
  void setMaxAngle(double max_angle_rad) { max_angle_rad_ = max_angle_rad; }
  /// True: points without normal (NaN) count as well seen.
  void setKeepUnknown(bool keep_unknown) { keep_unknown_ = keep_unknown; }

 protected:
  using ChoosingFilter<PointT>::applyFilter;

  void applyFilter(pcl::Indices& indices) override {
    const pcl::PointCloud<PointT>& cloud = *this->input_;
    const Eigen::Vector3f viewpoint =
        viewpoint_ ? *viewpoint_ : Eigen::Vector3f(cloud.sensor_origin_.template head<3>());
    const auto least = static_cast<float>(std::cos(max_angle_rad_));

    // Either side of the surface may face the camera
    this->choose(indices, [&](std::size_t i) {
      if (!pcl::isNormalFinite(cloud[i])) return keep_unknown_;
      const Eigen::Vector3f ray = viewpoint - cloud[i].getVector3fMap();
      return std::abs(cloud[i].getNormalVector3fMap().dot(ray)) >= least * ray.norm();
    });
  }

 private:
  std::optional<Eigen::Vector3f> viewpoint_;
  double max_angle_rad_ = 1.3;
  bool keep_unknown_ = false;
};

}  // namespace plumbline::cloud
