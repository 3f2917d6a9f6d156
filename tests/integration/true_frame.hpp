// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Where results lie in the generated world that was filmed.
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <filesystem>
#include <utility>
#include <vector>

#include "plumbline/dataset/trajectory_io.hpp"

namespace plumbline::integration {

/// Places of the camera at the stamps that both files have: those of the first, and those of the second.
inline std::pair<std::vector<Eigen::Vector3d>, std::vector<Eigen::Vector3d>> common_places(
    const std::filesystem::path& poses, const std::filesystem::path& truth) {
  const auto path = dataset::read_trajectory(poses), true_path = dataset::read_trajectory(truth);
  std::pair<std::vector<Eigen::Vector3d>, std::vector<Eigen::Vector3d>> both;
  if (!path || !true_path) return both;
  for (const auto& a : *path) {
    for (const auto& b : *true_path) {
      if (std::abs(a.stamp - b.stamp) > 1e-4) continue;
      both.first.push_back(a.world_from_camera.translation);
      both.second.push_back(b.world_from_camera.translation);
      break;
    }
  }
  return both;
}

/// The motion, or the similarity, that leads from a result's path to the true one.
inline Eigen::Matrix4d true_frame(const std::filesystem::path& poses, const std::filesystem::path& truth,
                                  bool with_scale = true) {
  const auto [from, to] = common_places(poses, truth);
  if (from.size() < 3) return Eigen::Matrix4d::Zero();
  const auto count = static_cast<Eigen::Index>(from.size());
  return Eigen::umeyama(Eigen::Map<const Eigen::Matrix3Xd>(from.front().data(), 3, count),
                        Eigen::Map<const Eigen::Matrix3Xd>(to.front().data(), 3, count), with_scale);
}

}  // namespace plumbline::integration
