// SPDX-License-Identifier: BSD-3-Clause
// Precompiled header of the modules that see PCL.
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <string>
#include <vector>
