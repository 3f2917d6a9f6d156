// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Covariances of the poses of a bundle (docs/method/refinement.md).
#include <vector>

#include "plumbline/optimize/bundle_adjustment.hpp"

namespace plumbline::optimize {

/// Accuracy of the poses of an adjusted problem relative to those that are fixed: covariance of (rho, phi) in
/// Exp(rho, phi) camera_from_world, metres and radians, with landmarks and other poses free; zero for fixed
/// poses. Standard deviations and losses are assumed to be right, outliers are left out. Empty if something
/// leaves a pose free. Memory grows with the square, and time with the cube of the number of poses.
std::vector<geometry::Matrix6d> pose_covariances(const BundleProblem& problem, const BundleOptions& options);

}  // namespace plumbline::optimize
