// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/cloud/fusion/floor.hpp"

#include <pcl/filters/voxel_grid.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/segmentation/sac_segmentation.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>

namespace plumbline::cloud {
namespace {

struct Found {
  Floor plane;
  std::size_t voxels = 0;
};

/// Points that face `up`, one for each voxel.
CloudPtr thinned(const Cloud& cloud, const Eigen::Vector3f& up) {
  constexpr float kVoxel_m = 0.05F;
  const float cosine = std::cos(0.25F * static_cast<float>(M_PI));
  auto facing_up = std::make_shared<Cloud>();
  for (const Point& p : cloud) {
    if (p.getNormalVector3fMap().dot(up) > cosine && p.getVector3fMap().allFinite()) facing_up->push_back(p);
  }
  if (facing_up->empty()) return facing_up;
  pcl::VoxelGrid<Point> grid;
  grid.setLeafSize(kVoxel_m, kVoxel_m, kVoxel_m);
  grid.setInputCloud(facing_up);
  auto means = std::make_shared<Cloud>();
  grid.filter(*means);
  return means;
}

/// RANSAC among some of the points: within 3 cm of a plane whose normal is within 45 degrees of `axis`; the
/// plane's least squares. In order; empty when there is no plane.
pcl::Indices level_plane(const CloudConstPtr& points, const pcl::IndicesPtr& among,
                         const Eigen::Vector3d& axis, Eigen::Vector4d& plane) {
  pcl::SACSegmentation<Point> segmentation;  // always the same random numbers
  segmentation.setModelType(pcl::SACMODEL_PERPENDICULAR_PLANE);
  segmentation.setMethodType(pcl::SAC_RANSAC);
  segmentation.setAxis(axis.cast<float>());
  segmentation.setEpsAngle(0.25 * M_PI);
  segmentation.setDistanceThreshold(0.03);
  segmentation.setMaxIterations(1000);
  segmentation.setInputCloud(points);
  segmentation.setIndices(among);

  pcl::PointIndices inliers;
  pcl::ModelCoefficients coefficients;
  segmentation.segment(inliers, coefficients);

  // The caller subtracts sorted sets
  std::sort(inliers.indices.begin(), inliers.indices.end());

  for (std::size_t i = 0; i < 4 && !inliers.indices.empty(); ++i) {
    plane[static_cast<Eigen::Index>(i)] = static_cast<double>(coefficients.values[i]);
  }

  return inliers.indices;
}

/// Planes by RANSAC, one after the other among the remaining points; the first is the largest, or nearly so.
std::vector<Found> planes_of(const CloudConstPtr& points, const Eigen::Vector3d& up) {
  constexpr std::size_t kFewest = 50, kMost = 8;
  constexpr double kLargeShare = 0.2;  // of the largest one
  std::vector<Found> planes;
  auto left = std::make_shared<pcl::Indices>(points->size());
  std::iota(left->begin(), left->end(), 0);

  std::size_t enough = kFewest;
  while (planes.size() < kMost && left->size() >= enough) {
    Eigen::Vector4d plane;
    const pcl::Indices inliers = level_plane(points, left, up, plane);
    if (inliers.size() < enough) break;

    // Normals point up
    const double sign = plane.head<3>().dot(up) < 0.0 ? -1.0 : 1.0;
    planes.push_back({{sign * plane.head<3>(), -sign * plane[3]}, inliers.size()});
    enough = std::max(enough, static_cast<std::size_t>(kLargeShare * static_cast<double>(inliers.size())));

    // The next plane is among the other points
    auto rest = std::make_shared<pcl::Indices>();
    std::set_difference(left->begin(), left->end(), inliers.begin(), inliers.end(),
                        std::back_inserter(*rest));
    left = rest;
  }

  return planes;
}

}  // namespace

std::optional<Floor> find_floor(const CloudConstPtr& cloud, const Eigen::Vector3d& about_up) {
  if (cloud == nullptr || cloud->empty()) return std::nullopt;
  const CloudConstPtr points = thinned(*cloud, about_up.cast<float>());
  const std::vector<Found> planes = planes_of(points, about_up);

  // The lowest of the planes parallel to the largest
  const double alongside = std::cos(5.0 * M_PI / 180.0);
  std::optional<Floor> floor;
  for (const Found& found : planes) {
    if (found.plane.normal.dot(planes.front().plane.normal) < alongside) continue;
    if (!floor || found.plane.height_m < floor->height_m) floor = found.plane;
  }
  return floor;
}

}  // namespace plumbline::cloud
