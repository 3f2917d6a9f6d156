// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Pose of a cloud's sensor, as PCL keeps it with every cloud.
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include "plumbline/cloud/types.hpp"
#include "plumbline/geometry/rigid3.hpp"

namespace plumbline::cloud {

/// Sensor pose of a cloud, for a keyframe's cloud camera_from_depth: its points are those of the depth camera
/// at the moment of the depth image, while poses are those of the colour image, which has its own stamp.
/// Identity unless it was set.
inline geometry::Rigid3 sensor_pose(const Cloud& cloud) {
  const Eigen::Vector3f origin = cloud.sensor_origin_.head<3>();
  if (origin.isZero(0.0F) && cloud.sensor_orientation_.coeffs() == Eigen::Quaternionf::Identity().coeffs()) {
    return {};  // to the last bit
  }
  return {cloud.sensor_orientation_.cast<double>(), origin.cast<double>()};
}
inline void set_sensor_pose(Cloud& cloud, const geometry::Rigid3& camera_from_depth) {
  cloud.sensor_origin_.head<3>() = camera_from_depth.translation.cast<float>();
  cloud.sensor_orientation_ = camera_from_depth.quaternion().cast<float>();
}

}  // namespace plumbline::cloud
