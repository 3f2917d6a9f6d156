// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The functions of this part; pcl_functions.hpp tells what they do.
#include "pcl_functions.hpp"

namespace plumbline::cloud {

CloudPtr voxel_grid(const CloudConstPtr& points, float leaf, unsigned min_points);
CloudPtr approximate_voxel_grid(const CloudConstPtr& points, float leaf);
pcl::Indices uniform_sampling(const CloudConstPtr& points, double radius);
CloudPtr random_sample(const CloudConstPtr& points, unsigned sample, unsigned seed);
CloudPtr crop_box(const CloudConstPtr& input, const Eigen::Vector4f& min, const Eigen::Vector4f& max,
                  bool negative);
CloudPtr pass_through(const CloudConstPtr& input, const std::string& field, float min, float max,
                      bool negative);
std::vector<bool> packed_rgb_within(const Cloud& input, const std::string& component, double min, double max);
std::vector<bool> field_within(const Cloud& input, const std::string& field, double min, double max);
pcl::PointCloud<pcl::Normal> normal_estimation(const CloudConstPtr& points,
                                               const pcl::search::Search<Point>::Ptr& search, int k,
                                               double radius, const Eigen::Vector3f& viewpoint);
pcl::Indices plane(const CloudConstPtr& points, const pcl::IndicesPtr& among, double distance,
                   int max_iterations, PlaneFit fit);
std::vector<pcl::PointIndices> euclidean_clusters(const CloudConstPtr& points, double tolerance,
                                                  int min_size);
CloudPtr moving_least_squares(const CloudConstPtr& points, double radius, int order, pcl::Indices& indices);
pcl::PolygonMesh poisson(const pcl::PointCloud<pcl::PointNormal>::ConstPtr& points, int depth);

}  // namespace plumbline::cloud
