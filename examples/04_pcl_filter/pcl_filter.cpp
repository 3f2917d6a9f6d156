// SPDX-License-Identifier: BSD-3-Clause
// Plumbline's filters in a program of PCL's, without any pipeline: they are used as pcl::PassThrough is.
//
//   pcl_filter
//
// A depth camera looks at a box in front of a wall, on a floor; the pixels at the box's border hang in the
// air. Prints what each filter leaves of the picture.
#include <pcl/filters/passthrough.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <cmath>
#include <cstdio>
#include <memory>

#include "plumbline/cloud/filters/flying_pixels.hpp"
#include "plumbline/cloud/filters/incidence_angle.hpp"
#include "plumbline/cloud/filters/normal_consistency.hpp"

using namespace plumbline;

namespace {

using Points = pcl::PointCloud<pcl::PointNormal>;

/// 320 x 240 pixels, seen from the origin along z; metres, y points down.
Points::Ptr picture() {
  auto points = std::make_shared<Points>(320, 240);

  for (int v = 0; v < 240; ++v) {
    for (int u = 0; u < 320; ++u) {
      const Eigen::Vector3f ray(static_cast<float>(u - 160) / 260.0F, static_cast<float>(v - 120) / 260.0F,
                                1.0F);
      Eigen::Vector3f normal(0.0F, 0.0F, -1.0F);
      float depth = 3.0F;            // the wall
      if (ray.y() * depth > 1.0F) {  // the floor
        depth = 1.0F / ray.y();
        normal = Eigen::Vector3f(0.0F, -1.0F, 0.0F);
      }

      // The box, whose border hangs between it and the wall
      const bool box = u >= 100 && u < 200 && v >= 60 && v < 160;
      const bool border = box && (u == 100 || u == 199 || v == 60 || v == 159);
      if (box) depth = border ? 2.1F : 1.5F;
      pcl::PointNormal& p = (*points)(u, v);
      p.getVector3fMap() = depth * ray;
      p.getNormalVector3fMap() = normal;
      if (u % 20 == 10 && v % 20 == 10) p.getNormalVector3fMap() = Eigen::Vector3f::UnitX();  // gone wrong
    }
  }

  return points;
}

std::size_t measured(const Points& points) {
  std::size_t count = 0;
  for (const auto& p : points) count += pcl::isFinite(p) ? 1U : 0U;
  return count;
}

/// Points that the filter keeps, still as a picture: the others are NaN.
Points::Ptr filtered(pcl::FilterIndices<pcl::PointNormal>& filter, const Points::ConstPtr& points,
                     const char* name) {
  auto left = std::make_shared<Points>();
  filter.setInputCloud(points);
  filter.setKeepOrganized(true);
  filter.filter(*left);
  std::printf("%-20s %5zu of %5zu points, %u x %u\n", name, measured(*left), measured(*points), left->width,
              left->height);
  return left;
}

}  // namespace

int main() {
  const Points::ConstPtr points = picture();
  pcl::PassThrough<pcl::PointNormal> depth(true);  // true, as for all that keep the picture's shape
  depth.setFilterFieldName("z");
  depth.setFilterLimits(0.3F, 4.0F);
  cloud::FlyingPixels<pcl::PointNormal> flying(true);
  flying.setSigmas(4.0);
  cloud::IncidenceAngle<pcl::PointNormal> incidence(true);
  incidence.setMaxAngle(75.0 * M_PI / 180.0);
  cloud::NormalConsistency<pcl::PointNormal> consistency(true);
  consistency.setNeighbours(8);

  Points::Ptr left = filtered(depth, points, "PassThrough");
  left = filtered(flying, left, "FlyingPixels");
  left = filtered(incidence, left, "IncidenceAngle");
  left = filtered(consistency, left, "NormalConsistency");

  // Indices of the points that one of the filters removes.
  flying.setInputCloud(points);
  flying.setNegative(true);
  pcl::Indices hanging;
  flying.filter(hanging);
  std::size_t between = 0;
  for (const int i : hanging) between += std::abs((*points)[static_cast<std::size_t>(i)].z - 2.1F) < 0.01F;
  std::printf("%zu points at depth jumps, %zu of them in the air; %zu points stay\n", hanging.size(), between,
              measured(*left));
  return 0;
}
