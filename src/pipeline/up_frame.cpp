// SPDX-License-Identifier: BSD-3-Clause
#include "up_frame.hpp"

#include "plumbline/cloud/floor.hpp"
#include "plumbline/viz/snapshot.hpp"

namespace plumbline::pipeline {

UpFrame find_up(Up wanted, const cloud::CloudConstPtr& cloud, const geometry::Trajectory& trajectory) {
  UpFrame frame;
  if (wanted == Up::kNone || trajectory.empty()) return frame;
  const geometry::Rigid3& first = trajectory.front().world_from_camera;
  Eigen::Vector3d up = -first.rotation.col(1);
  double ground = up.dot(first.translation);
  frame.up = "camera";
  if (wanted == Up::kFloor) {
    if (const auto floor = cloud::find_floor(cloud, viz::mean_camera_up({trajectory}))) {
      up = floor->normal;
      ground = floor->height_m;
      frame.up = "floor";
    }
  }
  Eigen::Vector3d ahead = first.rotation.col(2) - first.rotation.col(2).dot(up) * up;
  if (ahead.norm() < 0.1) ahead = first.rotation.col(1) - first.rotation.col(1).dot(up) * up;
  Eigen::Matrix3d axes;  // of the output in the map
  axes.col(2) = up.normalized();
  axes.col(0) = ahead.normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  const Eigen::Vector3d origin = first.translation + (ground - up.dot(first.translation)) * up;
  frame.output_from_map = geometry::Rigid3(axes, origin).inverse();
  return frame;
}

}  // namespace plumbline::pipeline
