// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Free space seen by the map's cameras: the rays from a view to its measured points.
#include <Eigen/Core>
#include <functional>
#include <vector>

#include "plumbline/core/error.hpp"

namespace plumbline::maps {

/// The rays of one view, in the frame of the results.
struct ViewRays {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3f> ends;  ///< measured points
};

/// Hands the rays of all views, one after another, to its argument.
using ForEachView =
    std::function<core::Result<void>(const std::function<core::Result<void>(const ViewRays&)>&)>;

}  // namespace plumbline::maps
