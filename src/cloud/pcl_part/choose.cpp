// SPDX-License-Identifier: BSD-3-Clause
// PCL's filters: some of the points, or the means of some.
#include <pcl/filters/approximate_voxel_grid.h>
#include <pcl/filters/conditional_removal.h>
#include <pcl/filters/crop_box.h>
#include <pcl/filters/passthrough.h>
#include <pcl/filters/random_sample.h>
#include <pcl/filters/uniform_sampling.h>
#include <pcl/filters/voxel_grid.h>

#include "functions.hpp"

namespace plumbline::cloud {
namespace {

template <typename Filter>
CloudPtr run(Filter& filter, const CloudConstPtr& input) {
  filter.setInputCloud(input);
  auto output = std::make_shared<Cloud>();
  filter.filter(*output);
  return output;
}

/// Which points meet both comparisons. Not ConditionalRemoval's own run: it has no negative, and it moves an
/// organised cloud's rejected points only.
template <typename Compare>
std::vector<bool> within(const Cloud& input, const std::string& name, double min, double max) {
  pcl::ConditionAnd<Point> both;
  both.addComparison(std::make_shared<Compare>(name, pcl::ComparisonOps::GE, min));
  both.addComparison(std::make_shared<Compare>(name, pcl::ComparisonOps::LE, max));
  std::vector<bool> result;
  result.reserve(input.size());
  for (const Point& p : input.points) result.push_back(both.evaluate(p));
  return result;
}

}  // namespace

CloudPtr voxel_grid(const CloudConstPtr& points, float leaf, unsigned min_points) {
  pcl::VoxelGrid<Point> grid;
  grid.setLeafSize(leaf, leaf, leaf);
  grid.setMinimumPointsNumberPerVoxel(min_points);
  return run(grid, points);
}

CloudPtr approximate_voxel_grid(const CloudConstPtr& points, float leaf) {
  pcl::ApproximateVoxelGrid<Point> grid;
  grid.setLeafSize(leaf, leaf, leaf);
  return run(grid, points);
}

pcl::Indices uniform_sampling(const CloudConstPtr& points, double radius) {
  pcl::UniformSampling<Point> sampling(true);
  sampling.setRadiusSearch(radius);
  run(sampling, points);
  return *sampling.getRemovedIndices();
}

CloudPtr random_sample(const CloudConstPtr& points, unsigned sample, unsigned seed) {
  pcl::RandomSample<Point> filter;
  filter.setSample(sample);
  filter.setSeed(seed);
  return run(filter, points);
}

CloudPtr crop_box(const CloudConstPtr& input, const Eigen::Vector4f& min, const Eigen::Vector4f& max,
                  bool negative) {
  pcl::CropBox<Point> crop(true);  // true: PCL prints a line otherwise
  crop.setMin(min);
  crop.setMax(max);
  crop.setNegative(negative);
  crop.setKeepOrganized(input->height > 1);
  return run(crop, input);
}

CloudPtr pass_through(const CloudConstPtr& input, const std::string& field, float min, float max,
                      bool negative) {
  pcl::PassThrough<Point> pass(true);
  pass.setFilterFieldName(field);
  pass.setFilterLimits(min, max);
  pass.setNegative(negative);
  pass.setKeepOrganized(input->height > 1);
  return run(pass, input);
}

std::vector<bool> packed_rgb_within(const Cloud& input, const std::string& component, double min,
                                    double max) {
  return within<pcl::PackedRGBComparison<Point>>(input, component, min, max);
}

std::vector<bool> field_within(const Cloud& input, const std::string& field, double min, double max) {
  return within<pcl::FieldComparison<Point>>(input, field, min, max);
}

}  // namespace plumbline::cloud
