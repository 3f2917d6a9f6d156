// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Terms of matched landmarks for the pose (optimize/pose_solver.hpp), in the order of the matches.
#include <cstddef>
#include <vector>

#include "plumbline/optimize/pose_solver.hpp"
#include "plumbline/tracking/association.hpp"

namespace plumbline::tracking {

/// Reprojection, and depth where it was measured.
std::vector<optimize::PointTerm> point_terms(const maps::Map& map, const std::vector<PointMatch>& matches,
                                             const features::FrameFeatures& features,
                                             const AssociationOptions& options);

/// Distances of the measured ends from the projected Pluecker line. `sigma_px`: their standard deviation.
std::vector<optimize::LineTerm> line_terms(const maps::Map& map, const std::vector<LineMatch>& matches,
                                           const features::FrameFeatures& features, double sigma_px);

/// Keeps what fits at the estimated pose.
template <typename Match, typename Term>
void keep_inliers(const std::vector<double>& errors, double gate, std::vector<Match>& matches,
                  std::vector<Term>& terms) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    if (!(errors[i] <= gate)) continue;
    matches[kept] = matches[i];
    terms[kept] = terms[i];
    ++kept;
  }
  matches.resize(kept);
  terms.resize(kept);
}

}  // namespace plumbline::tracking
