// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Alignment of one cloud with another, as evaluate_cloud aligns a cloud with its reference.
#include "plumbline/core/executor.hpp"
#include "plumbline/evaluate/surface.hpp"
#include "plumbline/geometry/rigid3.hpp"

namespace plumbline::evaluate {

struct CloudFit {
  geometry::Rigid3 reference_from_cloud;  ///< of points with their shift
  double overlap = 0.0;                   ///< share of the cloud with a partner in reach at the end
  double rmse_m = 0.0;                    ///< point to plane, of the nearest 80 % of these
  bool found = false;                     ///< it came to rest, and the surfaces fix all directions
};

/// Trimmed point-to-plane ICP of the finite points of `cloud` onto those of `reference` from `start`; pairs
/// are at most `reach_m` apart to begin with. Same result for any number of threads.
CloudFit fit_cloud(const SurfaceSamples& cloud, const SurfaceSamples& reference,
                   const geometry::Rigid3& start, double reach_m, const core::Executor& executor);

}  // namespace plumbline::evaluate
