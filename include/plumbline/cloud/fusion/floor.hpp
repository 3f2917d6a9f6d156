// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The floor of a map, which shows which way is up.
#include <Eigen/Core>
#include <optional>

#include "plumbline/cloud/types.hpp"

namespace plumbline::cloud {

struct Floor {
  Eigen::Vector3d normal;  ///< unit, up
  double height_m = 0.0;   ///< normal . p of its points
};

/// Planes of what faces up, within 45 degrees of `about_up` (unit), by RANSAC on the means of voxels; the
/// floor is the lowest of those that have a fifth of the largest one's extent and run alongside it. The same
/// cloud gives the same floor. None where no such plane is seen, the cloud is null, or PCL's part is missing.
std::optional<Floor> find_floor(const CloudConstPtr& cloud, const Eigen::Vector3d& about_up);

}  // namespace plumbline::cloud
