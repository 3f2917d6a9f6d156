// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/geometry/pose_convention.hpp"

namespace plumbline::geometry {

const std::vector<std::pair<std::string, PoseConvention>>& pose_conventions() {
  static const std::vector<std::pair<std::string, PoseConvention>> all = {
      {"inverted", PoseConvention::kInverted},
      {"opengl", PoseConvention::kOpenGl},
      {"wxyz", PoseConvention::kWFirst}};
  return all;
}

Rigid3 read_by(PoseConvention convention, const Rigid3& pose) {
  switch (convention) {
    case PoseConvention::kWorldFromCamera:
      return pose;
    case PoseConvention::kInverted:
      return pose.inverse();
    case PoseConvention::kOpenGl:
      return {pose.rotation * Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal(), pose.translation};
    case PoseConvention::kWFirst: {
      const Eigen::Quaterniond q = pose.quaternion();
      return {Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w()), pose.translation};
    }
  }
  return pose;
}

}  // namespace plumbline::geometry
