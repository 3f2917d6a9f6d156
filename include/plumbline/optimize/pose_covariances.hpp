// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Covariances of the poses of a bundle (docs/method/refinement.md).
#include <string>
#include <vector>

#include "plumbline/optimize/bundle_adjustment.hpp"

namespace plumbline::optimize {

struct PoseCovariances {
  /// Covariance of (rho, phi) in Exp(rho, phi) camera_from_world of each pose, metres and radians; zero for
  /// fixed poses. NaN in the rows and columns of a position or a rotation that nothing relates to the fixed
  /// poses. Empty: see `missing`.
  std::vector<geometry::Matrix6d> of_pose;
  std::string missing;  ///< why there are none; empty otherwise
};

/// Accuracy of the poses of an adjusted problem relative to those that are fixed, with landmarks and other
/// poses free. Standard deviations and losses are assumed to be right, outliers are left out. Up to 600 free
/// poses memory grows with their square and time with their cube; above, both grow with the number of pairs
/// of poses that share landmarks, and a problem that needs more than 15 million numbers has no result.
PoseCovariances pose_covariances(const BundleProblem& problem, const BundleOptions& options);

}  // namespace plumbline::optimize
