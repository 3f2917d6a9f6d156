// SPDX-License-Identifier: BSD-3-Clause
// PCL's normals, planes and clusters.
#include <pcl/features/normal_3d.h>
#include <pcl/sample_consensus/ransac.h>
#include <pcl/sample_consensus/sac_model_plane.h>
#include <pcl/search/kdtree.h>
#include <pcl/segmentation/extract_clusters.h>
#include <pcl/segmentation/sac_segmentation.h>

#include "functions.hpp"

namespace plumbline::cloud {

pcl::PointCloud<pcl::Normal> normal_estimation(const CloudConstPtr& points,
                                               const pcl::search::Search<Point>::Ptr& search, int k,
                                               double radius, const Eigen::Vector3f& viewpoint) {
  pcl::NormalEstimation<Point, pcl::Normal> estimation;
  estimation.setSearchMethod(search);
  if (k > 0) {
    estimation.setKSearch(k);
  } else {
    estimation.setRadiusSearch(radius);
  }
  estimation.setViewPoint(viewpoint.x(), viewpoint.y(), viewpoint.z());
  estimation.setInputCloud(points);
  pcl::PointCloud<pcl::Normal> normals;
  estimation.compute(normals);
  return normals;
}

pcl::Indices plane(const CloudConstPtr& points, const pcl::IndicesPtr& among, double distance,
                   int max_iterations, PlaneFit fit) {
  if (fit == PlaneFit::kSpread) {
    const auto model = std::make_shared<pcl::SampleConsensusModelPlane<Point>>(points, *among);
    pcl::RandomSampleConsensus<Point> ransac(model, distance);
    ransac.setMaxIterations(max_iterations);
    pcl::Indices inliers;
    if (!ransac.computeModel()) return inliers;
    ransac.refineModel(2.0, 50);
    ransac.getInliers(inliers);
    return inliers;
  }
  pcl::SACSegmentation<Point> segmentation;  // always the same random numbers
  segmentation.setModelType(pcl::SACMODEL_PLANE);
  segmentation.setMethodType(pcl::SAC_RANSAC);
  segmentation.setDistanceThreshold(distance);
  segmentation.setMaxIterations(max_iterations);
  segmentation.setOptimizeCoefficients(fit == PlaneFit::kOnce);
  segmentation.setInputCloud(points);
  segmentation.setIndices(among);
  pcl::PointIndices inliers;
  pcl::ModelCoefficients coefficients;
  segmentation.segment(inliers, coefficients);
  return inliers.indices;
}

std::vector<pcl::PointIndices> euclidean_clusters(const CloudConstPtr& points, double tolerance,
                                                  int min_size) {
  std::vector<pcl::PointIndices> clusters;
  pcl::EuclideanClusterExtraction<Point> extraction;
  extraction.setClusterTolerance(tolerance);
  extraction.setMinClusterSize(min_size);
  auto tree = std::make_shared<pcl::search::KdTree<Point>>(false);
  tree->setInputCloud(points);
  extraction.setSearchMethod(tree);
  extraction.setInputCloud(points);
  extraction.extract(clusters);
  return clusters;
}

}  // namespace plumbline::cloud
