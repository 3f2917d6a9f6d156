// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/cloud/view_points.hpp"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>

#include "plumbline/cloud/free_space.hpp"
#include "plumbline/cloud/sensor_pose.hpp"

namespace plumbline::cloud {

void ViewPoints::resize(std::size_t count) {
  for (std::vector<float>* column : {&x, &y, &z, &normal_x, &normal_y, &normal_z}) column->resize(count);
  for (std::vector<std::uint8_t>* column : {&r, &g, &b}) column->resize(count);
}

void take_points(const Cloud& camera_cloud, ViewPoints& points) {
  points.resize(camera_cloud.size());
  std::size_t count = 0;
  for (const Point& p : camera_cloud.points) {
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) continue;
    points.x[count] = p.x;
    points.y[count] = p.y;
    points.z[count] = p.z;
    points.normal_x[count] = p.normal_x;
    points.normal_y[count] = p.normal_y;
    points.normal_z[count] = p.normal_z;
    points.r[count] = p.r;
    points.g[count] = p.g;
    points.b[count] = p.b;
    ++count;
  }
  points.resize(count);
  points.width = camera_cloud.width;
  points.height = camera_cloud.height;
  points.camera_from_depth = sensor_pose(camera_cloud);
}

bool is_look(const ViewPoints& points, const sensor::Pinhole& camera) {
  constexpr int kCell = DepthRaster::kCell_px;
  if (points.height < 2 || points.width != static_cast<std::uint32_t>((camera.width + kCell - 1) / kCell) ||
      points.height != static_cast<std::uint32_t>((camera.height + kCell - 1) / kCell)) {
    return false;
  }
  return std::none_of(points.normal_x.begin(), points.normal_x.end(),
                      [](float n) { return std::isfinite(n); });
}

}  // namespace plumbline::cloud
