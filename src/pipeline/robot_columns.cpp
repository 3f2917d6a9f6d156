// SPDX-License-Identifier: BSD-3-Clause
#include "robot_columns.hpp"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>
#include <unordered_map>

namespace plumbline::pipeline {
namespace {

using Cell = std::uint64_t;

Cell cell_of(const Eigen::Vector3f& p, float edge) {
  constexpr std::int64_t kHalf = 1 << 20;
  Cell cell = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto index = static_cast<std::int64_t>(std::floor(p[axis] / edge)) + kHalf;
    cell = cell << 21 | static_cast<Cell>(std::clamp<std::int64_t>(index, 0, 2 * kHalf - 1));
  }
  return cell;
}

/// Measurements of each robot in one cell.
struct Count {
  std::int32_t robot = 0;
  std::uint32_t points = 0;
};

}  // namespace

core::Result<std::vector<std::uint8_t>> robots_of_points(
    const cloud::Cloud& fused, const std::vector<geometry::Rigid3>& world_from_camera,
    const std::vector<std::int32_t>& robots, const cloud::ReadView& read, double voxel_m) {
  // Points were moved a little onto their planes: cells of twice the size, and neighbours where one is empty.
  const auto edge = static_cast<float>(2.0 * voxel_m);
  std::unordered_map<Cell, std::vector<Count>> cells;  // looked up only, never gone through
  for (const cloud::Point& p : fused.points) cells[cell_of(p.getVector3fMap(), edge)];
  for (std::size_t v = 0; v < world_from_camera.size(); ++v) {
    const auto view = read(v);
    if (!view) return tl::unexpected<core::Error>(view.error());
    const Eigen::Matrix3f rotation = world_from_camera[v].rotation.cast<float>();
    const Eigen::Vector3f translation = world_from_camera[v].translation.cast<float>();
    for (const cloud::Point& p : (*view)->points) {
      if (!std::isfinite(p.z)) continue;
      const auto found = cells.find(cell_of(rotation * p.getVector3fMap() + translation, edge));
      if (found == cells.end()) continue;
      auto count = std::find_if(found->second.begin(), found->second.end(),
                                [&](const Count& c) { return c.robot == robots[v]; });
      if (count == found->second.end()) count = found->second.insert(count, {robots[v], 0});
      ++count->points;
    }
  }
  const auto most = [&](const Eigen::Vector3f& p) -> std::int32_t {
    const auto found = cells.find(cell_of(p, edge));
    if (found == cells.end() || found->second.empty()) return -1;
    return std::min_element(found->second.begin(), found->second.end(),
                            [](const Count& a, const Count& b) {
                              return a.points != b.points ? a.points > b.points : a.robot < b.robot;
                            })
        ->robot;
  };
  std::vector<std::uint8_t> result;
  result.reserve(fused.size());
  for (const cloud::Point& p : fused.points) {
    std::int32_t robot = most(p.getVector3fMap());
    for (int side = 0; side < 6 && robot < 0; ++side) {
      Eigen::Vector3f offset = Eigen::Vector3f::Zero();
      offset[side / 2] = side % 2 == 0 ? edge : -edge;
      robot = most(p.getVector3fMap() + offset);
    }
    constexpr std::int32_t kMostRobots = 254;
    result.push_back(static_cast<std::uint8_t>(std::clamp(robot, 0, kMostRobots)));
  }
  return result;
}

}  // namespace plumbline::pipeline
