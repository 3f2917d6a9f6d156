// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Functions shared by several filters.
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "finite.hpp"
#include "plumbline/cloud/filters/filter.hpp"

namespace plumbline::cloud {

// One function per filter, each in its own file; the registry lists them.
FilterInfo approximate_voxel_grid_filter();
FilterInfo clusters_filter();
FilterInfo color_filter();
FilterInfo crop_box_filter();
FilterInfo curvature_filter();
FilterInfo flying_pixels_filter();
FilterInfo incidence_angle_filter();
FilterInfo merge_filter();
FilterInfo mls_filter();
FilterInfo normal_consistency_filter();
FilterInfo normals_filter();
FilterInfo pass_through_filter();
FilterInfo plane_filter();
FilterInfo radius_outlier_filter();
FilterInfo random_sampling_filter();
FilterInfo statistical_outlier_filter();
FilterInfo tee_filter();
FilterInfo transform_filter();
FilterInfo uniform_sampling_filter();
FilterInfo voxel_grid_filter();

inline bool has_normal(const Point& p) { return std::isfinite(p.normal_x + p.normal_y + p.normal_z); }
inline bool organised(const Cloud& cloud) { return cloud.height > 1; }

inline void reject(Point& p) {
  p.x = p.y = p.z = std::numeric_limits<float>::quiet_NaN();
  p.normal_x = p.normal_y = p.normal_z = std::numeric_limits<float>::quiet_NaN();
}

inline Eigen::Vector3f viewpoint_of(const Cloud& cloud, const FilterContext& context) {
  return context.viewpoint ? *context.viewpoint : Eigen::Vector3f(cloud.sensor_origin_.head<3>());
}

/// A cloud with the sensor pose and header of `model`, without points.
inline CloudPtr like(const Cloud& model) {
  auto cloud = std::make_shared<Cloud>();
  cloud->header = model.header;
  cloud->sensor_origin_ = model.sensor_origin_;
  cloud->sensor_orientation_ = model.sensor_orientation_;
  return cloud;
}

inline void make_list(Cloud& cloud) {
  cloud.width = static_cast<std::uint32_t>(cloud.size());
  cloud.height = 1;
  cloud.is_dense = true;
}

/// The points that are finite and for which keep(index, point) holds; an organised cloud keeps its shape.
template <typename Keep>
CloudPtr select(const Cloud& input, const Keep& keep) {
  auto output = like(input);

  // An organised cloud keeps its shape: rejected points become NaN
  if (organised(input)) {
    output->points = input.points;
    output->width = input.width;
    output->height = input.height;
    output->is_dense = false;

    for (std::size_t i = 0; i < input.size(); ++i) {
      if (!finite(input[i]) || !keep(i, input[i])) reject(output->points[i]);
    }
    return output;
  }

  // A list only holds the chosen points
  output->points.reserve(input.size());
  for (std::size_t i = 0; i < input.size(); ++i) {
    if (finite(input[i]) && keep(i, input[i])) output->points.push_back(input[i]);
  }
  make_list(*output);
  return output;
}

/// Points that a filter of PCL's kind (pcl::FilterIndices) keeps; an organised cloud keeps its shape.
template <typename PclFilter>
CloudPtr chosen_by(PclFilter& filter, const CloudConstPtr& input) {
  pcl::Indices kept;  // in the order of the input
  filter.setInputCloud(input);
  filter.filter(kept);
  auto next = kept.begin();
  return select(*input, [&](std::size_t i, const Point&) {
    while (next != kept.end() && static_cast<std::size_t>(*next) < i) ++next;
    return next != kept.end() && static_cast<std::size_t>(*next) == i;
  });
}

/// Result of one of PCL's filters on a cloud.
template <typename PclFilter>
CloudPtr filtered_by(PclFilter& filter, const CloudConstPtr& input) {
  filter.setInputCloud(input);
  auto output = std::make_shared<Cloud>();
  filter.filter(*output);
  return output;
}

/// The finite points as a new list, as PCL's searches and grids need them.
inline CloudPtr finite_list(const Cloud& input) {
  auto output = like(input);
  output->points.reserve(input.size());
  for (const Point& p : input.points) {
    if (finite(p)) output->points.push_back(p);
  }
  make_list(*output);
  return output;
}

/// The same for read-only use: the input itself if it is such a list already.
inline CloudConstPtr finite_list(const CloudConstPtr& input) {
  const bool list = !organised(*input) && input->width == input->size() && input->is_dense &&
                    std::all_of(input->begin(), input->end(), finite);
  return list ? input : CloudConstPtr(finite_list(*input));
}

}  // namespace plumbline::cloud
