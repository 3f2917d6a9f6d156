// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Messages of ROS 2 about a map, as the bytes that a MessageSink sends.
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/geometry/trajectory.hpp"

namespace plumbline::dataset {

using MessageBytes = core::Result<std::vector<std::uint8_t>>;

struct NamedTransform {
  std::string parent;
  std::string child;
  geometry::Rigid3 parent_from_child;
};

/// tf2_msgs/TFMessage, all at one stamp (seconds). Errors of all (kInternal): the part is missing.
MessageBytes transforms_message(const std::vector<NamedTransform>& transforms, double stamp);
/// The transforms of a tf2_msgs/TFMessage with their stamps (seconds). Errors: kInternal: the part is
/// missing; kInput: the bytes are none.
core::Result<std::vector<std::pair<double, NamedTransform>>> read_transforms(
    const std::vector<std::uint8_t>& bytes);
/// nav_msgs/Path in `frame`, its stamp that of the last pose.
MessageBytes path_message(const std::string& frame, const geometry::Trajectory& path);
/// sensor_msgs/PointCloud2 in `frame`; `points`: 16 bytes each, float x y z (metres), then blue, green, red,
/// 0.
MessageBytes points_message(const std::string& frame, double stamp, std::vector<std::uint8_t> points);

/// Cells of an occupancy grid, row by row from the lowest y: 0 free, 100 occupied, 255 unknown.
struct GridCells {
  double resolution_m = 0.05;
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();  ///< lower left corner of the whole grid
  std::int32_t x = 0;                                ///< first column of a part of the grid
  std::int32_t y = 0;                                ///< its first row
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::vector<std::uint8_t> cells;  ///< width x height
};
/// nav_msgs/OccupancyGrid in `frame`.
MessageBytes grid_message(const std::string& frame, double stamp, GridCells grid);
/// map_msgs/OccupancyGridUpdate: a part of a grid that was sent before.
MessageBytes grid_update_message(const std::string& frame, double stamp, GridCells part);
/// geometry_msgs/PoseWithCovarianceStamped in `frame`; standard deviations of each axis, metres and radians.
MessageBytes pose_message(const std::string& frame, double stamp, const geometry::Rigid3& pose,
                          double sigma_position_m, double sigma_rotation_rad);

}  // namespace plumbline::dataset
