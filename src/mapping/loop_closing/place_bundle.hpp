// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Bundle adjustment of R, t and the structure that two keyframes have in common (METHOD section 6).
#include <utility>
#include <vector>

#include "plumbline/mapping/observation_noise.hpp"
#include "plumbline/mapping/place_verification.hpp"

namespace plumbline::mapping {

/// Landmarks of the match's map, and the query's features that they are.
struct CommonLandmarks {
  std::vector<std::pair<core::PointId, int>> points;
  std::vector<std::pair<core::LineId, int>> lines;
};

/// The query's pose in the match's world, adjusted together with the landmarks; keyframes `around` the match
/// hold these where they see them, and stay. What it began with when nothing comes of it.
geometry::Rigid3 adjust_pair(const PlaceView& query, const PlaceView& match,
                             const std::vector<core::KeyframeId>& around, const CommonLandmarks& common,
                             const ObservationNoise& noise, const geometry::Rigid3& camera_from_world);

}  // namespace plumbline::mapping
