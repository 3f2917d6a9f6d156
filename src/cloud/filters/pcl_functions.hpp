// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Functions of PCL's libraries surface and io: these load VTK, so they are a part of their own
// (core/part.hpp). The rest of PCL is linked as usual.
#include <pcl/PolygonMesh.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include "plumbline/cloud/types.hpp"
#include "plumbline/core/part.hpp"

namespace plumbline::cloud {

/// One function per class of PCL, with its parameters by PCL's names. Points are finite.
struct PclFunctions {
  static constexpr const char* kPart = "pcl";
  static constexpr std::uint64_t layout() {
    return core::layout_of<PclFunctions, Point, Cloud, pcl::PointNormal, pcl::Indices, pcl::PolygonMesh>();
  }

  /// `indices` gets the indices of the points that are left.
  CloudPtr (*moving_least_squares)(const CloudConstPtr& points, double radius, int order,
                                   pcl::Indices& indices);
  pcl::PolygonMesh (*poisson)(const pcl::PointCloud<pcl::PointNormal>::ConstPtr& points, int depth);
  /// Bytes written, 0 when the input is damaged.
  unsigned (*lzf_decompress)(const void* input, unsigned input_size, void* output, unsigned output_size);
};

inline const core::Result<const PclFunctions*>& pcl_functions() { return core::part<PclFunctions>(); }

}  // namespace plumbline::cloud
