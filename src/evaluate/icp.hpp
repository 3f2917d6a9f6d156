// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Trimmed point-to-plane ICP of a cloud onto a surface (Chen and Medioni 1991; Chetverikov et al. 2002).
#include <vector>

#include "plumbline/core/executor.hpp"
#include "plumbline/geometry/rigid3.hpp"
#include "surfaces/measured_surface.hpp"

namespace plumbline::evaluate {

struct IcpOptions {
  double max_distance_m = 0.3;  ///< farthest pairs to start with; tightened as the cloud settles
  double trim = 0.8;            ///< share of the pairs kept, the nearest ones
};

struct IcpResult {
  geometry::Rigid3 reference_from_cloud;
  int iterations = 0;
  double rmse_m = 0.0;   ///< point to plane, of the pairs kept
  double overlap = 0.0;  ///< share of the cloud with a partner in reach at the end
  bool converged = false;
  /// True if the surfaces fix all six degrees of freedom; those that are not fixed stay as they started.
  bool determined = false;
};

IcpResult align_icp(const std::vector<Eigen::Vector3f>& cloud, const MeasuredSurface& surface,
                    const geometry::Rigid3& start, const IcpOptions& options, const core::Executor& executor);

}  // namespace plumbline::evaluate
