// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Free space seen by the map's cameras: the rays from a view to its measured points.
#include <functional>
#include <vector>

#include "source/map_source.hpp"

namespace plumbline::exports {

/// The rays of one view, in the frame of the results.
struct ViewRays {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3f> ends;  ///< measured points
};

/// Hands the rays of all views, one after another, to its argument.
using ForEachView =
    std::function<core::Result<void>(const std::function<core::Result<void>(const ViewRays&)>&)>;

/// Calls `take` with the rays of each view of the map, in order; of each view about one ray in 6 x 6 pixels.
/// Progress is reported. Errors (kInput): no map.db, or damaged; those of `take`.
core::Result<void> for_each_view(const MapSource& source,
                                 const std::function<core::Result<void>(const ViewRays&)>& take);

}  // namespace plumbline::exports
