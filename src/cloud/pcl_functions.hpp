// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What of PCL is in large libraries (filters, features, segmentation, surface, io): a part of its own
// (core/part.hpp), which filters that are PCL's ask for. The search trees are linked as usual.
#include <pcl/PointIndices.h>
#include <pcl/PolygonMesh.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/search/search.h>

#include <Eigen/Core>
#include <string>
#include <vector>

#include "plumbline/cloud/types.hpp"
#include "plumbline/core/part.hpp"

namespace plumbline::cloud {

enum class PlaneFit { kNever, kOnce, kSpread };

/// One function per class of PCL, with its parameters by PCL's names. Points are finite where not said
/// otherwise.
struct PclFunctions {
  static constexpr const char* kPart = "pcl";
  static constexpr std::uint64_t layout() {
    return core::layout_of<PclFunctions, Point, Cloud, pcl::PointNormal, pcl::Indices, pcl::PointIndices,
                           pcl::PolygonMesh, pcl::search::Search<Point>>();
  }

  CloudPtr (*voxel_grid)(const CloudConstPtr& points, float leaf, unsigned min_points);
  CloudPtr (*approximate_voxel_grid)(const CloudConstPtr& points, float leaf);
  /// Those that are left out.
  pcl::Indices (*uniform_sampling)(const CloudConstPtr& points, double radius);
  CloudPtr (*random_sample)(const CloudConstPtr& points, unsigned sample, unsigned seed);
  /// Any points; an organised cloud stays organised.
  CloudPtr (*crop_box)(const CloudConstPtr& input, const Eigen::Vector4f& min, const Eigen::Vector4f& max,
                       bool negative);
  CloudPtr (*pass_through)(const CloudConstPtr& input, const std::string& field, float min, float max,
                           bool negative);
  /// Of all points, whether min <= value <= max; the component is PCL's letter r, g or b.
  std::vector<bool> (*packed_rgb_within)(const Cloud& input, const std::string& component, double min,
                                         double max);
  std::vector<bool> (*field_within)(const Cloud& input, const std::string& field, double min, double max);
  /// `k` = 0: within `radius`.
  pcl::PointCloud<pcl::Normal> (*normal_estimation)(const CloudConstPtr& points,
                                                    const pcl::search::Search<Point>::Ptr& search, int k,
                                                    double radius, const Eigen::Vector3f& viewpoint);
  /// RANSAC among some of the points; empty when there is no plane.
  pcl::Indices (*plane)(const CloudConstPtr& points, const pcl::IndicesPtr& among, double distance,
                        int max_iterations, PlaneFit fit);
  std::vector<pcl::PointIndices> (*euclidean_clusters)(const CloudConstPtr& points, double tolerance,
                                                       int min_size);
  /// Those that are left are told by `indices`.
  CloudPtr (*moving_least_squares)(const CloudConstPtr& points, double radius, int order,
                                   pcl::Indices& indices);
  pcl::PolygonMesh (*poisson)(const pcl::PointCloud<pcl::PointNormal>::ConstPtr& points, int depth);
  /// Bytes written, 0 when the input is damaged.
  unsigned (*lzf_decompress)(const void* input, unsigned input_size, void* output, unsigned output_size);
};

inline const core::Result<const PclFunctions*>& pcl_functions() { return core::part<PclFunctions>(); }

}  // namespace plumbline::cloud
