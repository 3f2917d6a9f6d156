// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Bundle adjustment of R, t and the structure that two keyframes have in common (METHOD section 6).
#include <vector>

#include "plumbline/mapping/adjustment/observation_noise.hpp"
#include "plumbline/mapping/loop_closing/place_verification.hpp"
#include "plumbline/tracking/association.hpp"

namespace plumbline::mapping {

/// The query's pose in the match's world, adjusted together with the landmarks of the match's map that its
/// features see; keyframes `around` the match constrain these and are fixed. The initial pose if the
/// adjustment fails.
geometry::Rigid3 adjust_pair(const PlaceView& query, const PlaceView& match,
                             const std::vector<core::KeyframeId>& around,
                             const std::vector<tracking::PointMatch>& points,
                             const std::vector<tracking::LineMatch>& lines, const ObservationNoise& noise,
                             const geometry::Rigid3& camera_from_world);

}  // namespace plumbline::mapping
