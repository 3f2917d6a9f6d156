// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Surfaces as PCL sees them: points with normals, and the standard deviation along the normal (metres) as
// curvature. What is done with them on the way to aligned local maps: voxel filter and nearest neighbours, by
// PCL and FLANN.
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/search/kdtree.h>

#include <Eigen/Core>
#include <memory>

namespace plumbline::cloud {

using SurfacePoint = pcl::PointNormal;
using SurfaceCloud = pcl::PointCloud<SurfacePoint>;

/// `sigma_m`: standard deviation along its normal.
inline SurfacePoint surface_point(const Eigen::Vector3f& position, const Eigen::Vector3f& normal,
                                  float sigma_m) {
  SurfacePoint p;
  p.getVector3fMap() = position;
  p.getNormalVector3fMap() = normal;
  p.curvature = sigma_m;
  return p;
}

/// Means of what lies in one voxel and faces one way (pcl::VoxelGrid, one for each of six ways, so that both
/// sides of a thin wall stay apart). Points and normals that are not finite are left out. Filtered block by
/// block: however far the cloud reaches, no grid has as many cells as pcl::VoxelGrid cannot count.
/// `independent`: the points are measurements of their own, so that the deviation of their mean falls with
/// the root of their number; else it is the mean of theirs.
SurfaceCloud voxel_filtered(const SurfaceCloud& cloud, float voxel_m, bool independent);

/// Nearest neighbours among the points of a surface (pcl::search::KdTree).
class SurfaceSearch {
 public:
  using Tree = pcl::search::KdTree<SurfacePoint>;
  explicit SurfaceSearch(SurfaceCloud::ConstPtr cloud);
  [[nodiscard]] const SurfaceCloud::ConstPtr& cloud() const { return cloud_; }
  /// Search tree of this cloud; null if it is empty.
  [[nodiscard]] const Tree::Ptr& tree() const { return tree_; }

 private:
  SurfaceCloud::ConstPtr cloud_;
  Tree::Ptr tree_;
};

/// The nearest of the eight that lie nearest to `point`, within `distance_m`, that faces the same way (cosine
/// of at least `min_cosine`): its index in the tree's cloud; -1: none.
int nearest_facing(const SurfaceSearch::Tree& tree, const SurfacePoint& point, float distance_m,
                   float min_cosine);

}  // namespace plumbline::cloud
