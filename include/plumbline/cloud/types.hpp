// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The cloud type of the whole program. Only forward declarations: include <pcl/point_cloud.h> and
// <pcl/point_types.h> where points are touched.
#include <memory>

namespace pcl {
struct PointXYZRGBNormal;
template <typename PointT>
class PointCloud;
}  // namespace pcl

namespace plumbline::cloud {

/// Metres; colour 0-255; unit normal towards the camera that saw the point, NaN when unknown; a point without
/// measurement has NaN coordinates.
using Point = pcl::PointXYZRGBNormal;
using Cloud = pcl::PointCloud<Point>;
using CloudPtr = std::shared_ptr<Cloud>;             ///< the same type as Cloud::Ptr
using CloudConstPtr = std::shared_ptr<const Cloud>;  ///< the same type as Cloud::ConstPtr

}  // namespace plumbline::cloud
