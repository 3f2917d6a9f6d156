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

}  // namespace plumbline::dataset
