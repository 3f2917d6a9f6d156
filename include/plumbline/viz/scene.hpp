// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Contents of a picture of a map. Plain data, all in one frame (the map's), metres.
#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "plumbline/geometry/trajectory.hpp"
#include "plumbline/viz/color.hpp"

namespace pcl {
template <typename PointT>
class PointCloud;
struct PointXYZRGBNormal;
}  // namespace pcl

namespace plumbline::viz {

/// The path of one camera: a line with a mark at its start (ring) and at its end (disc).
struct CameraPath {
  std::string name;                 ///< shown in the legend; empty = not listed
  geometry::Trajectory trajectory;  ///< world_from_camera; camera axes x right, y down, z forward
  Rgb color = category_color(0);
};

struct Segment {
  Eigen::Vector3d a = Eigen::Vector3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
};

struct Scene {
  /// May be null or empty. Points with a non-finite coordinate are skipped. Normals point to the side
  /// the surface was seen from; a zero or non-finite normal means "not known".
  std::shared_ptr<const pcl::PointCloud<pcl::PointXYZRGBNormal>> cloud;
  /// One value per point, or empty: robot index for ColorMode::kRobot, metres for kError, any number for
  /// kConfidence. Non-finite = no value (grey).
  std::vector<float> scalars;
  std::string scalar_label;              ///< label of the colour bar, with the unit: "error (mm)"
  std::vector<std::string> robot_names;  ///< names in the legend of ColorMode::kRobot, by robot index
  std::vector<CameraPath> paths;
  std::vector<Segment> segments;  ///< 3D line landmarks
  Rgb segment_color{200, 30, 60};
  std::string title;
};

}  // namespace plumbline::viz
