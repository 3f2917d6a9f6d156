// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Covariances of the poses of a bundle (docs/method/refinement.md).
#include <vector>

#include "plumbline/optimize/bundle_adjustment.hpp"

namespace plumbline::optimize {

/// How exactly the poses of an adjusted problem are known beside those that are fixed: covariance of (rho,
/// phi) in Exp(rho, phi) camera_from_world, metres and radians, landmarks and other poses being free; zero
/// for fixed ones. Standard deviations and losses are taken at their word, outliers are left out. Empty when
/// something leaves a pose free. Memory and time grow with the square and the cube of the poses.
std::vector<geometry::Matrix6d> pose_covariances(const BundleProblem& problem, const BundleOptions& options);

}  // namespace plumbline::optimize
