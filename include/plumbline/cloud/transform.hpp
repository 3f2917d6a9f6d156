// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pcl/common/transforms.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include "plumbline/cloud/types.hpp"
#include "plumbline/geometry/rigid3.hpp"

namespace plumbline::cloud {

/// Moves points and normals in place, worked out in double precision.
inline void transform(Cloud& cloud, const geometry::Rigid3& to_from) {
  pcl::transformPointCloudWithNormals(cloud, cloud, Eigen::Affine3d(to_from.isometry()));
}

}  // namespace plumbline::cloud
