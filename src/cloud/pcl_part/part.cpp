// SPDX-License-Identifier: BSD-3-Clause
#include <pcl/io/lzf.h>
#include <pcl/search/kdtree.h>
#include <pcl/surface/mls.h>
#include <pcl/surface/poisson.h>

#include "filters/pcl_functions.hpp"

namespace plumbline::cloud {
namespace {

CloudPtr moving_least_squares(const CloudConstPtr& points, double radius, int order, pcl::Indices& indices) {
  pcl::MovingLeastSquares<Point, Point> mls;
  mls.setSearchMethod(std::make_shared<pcl::search::KdTree<Point>>());
  mls.setSearchRadius(radius);
  mls.setPolynomialOrder(order);
  mls.setComputeNormals(true);
  mls.setCacheMLSResults(false);  // hundreds of bytes a point, only needed to add points
  mls.setInputCloud(points);
  auto output = std::make_shared<Cloud>();
  mls.process(*output);
  indices = mls.getCorrespondingIndices()->indices;
  return output;
}

pcl::PolygonMesh poisson(const pcl::PointCloud<pcl::PointNormal>::ConstPtr& points, int depth) {
  pcl::Poisson<pcl::PointNormal> reconstruction;
  reconstruction.setDepth(depth);
  reconstruction.setThreads(1);  // the same mesh every time
  reconstruction.setInputCloud(points);
  pcl::PolygonMesh mesh;
  reconstruction.reconstruct(mesh);
  return mesh;
}

}  // namespace
}  // namespace plumbline::cloud

namespace pc = plumbline::cloud;
PLUMBLINE_PART(pc::PclFunctions, &pc::moving_least_squares, &pc::poisson, &pcl::lzfDecompress)
