// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Which keyframes of a map saw a place.
#include <Eigen/Core>
#include <utility>
#include <vector>

#include "plumbline/core/executor.hpp"
#include "plumbline/core/ids.hpp"
#include "plumbline/maps/stored_maps.hpp"

namespace plumbline::adjust {

/// A place as keyframes see it, in their cameras' frames.
using PlaceViews = std::vector<std::pair<core::KeyframeId, Eigen::Vector3d>>;

/// For each place (frame of results) the keyframes, eight at most, on whose surface it lies; none: nobody saw
/// it. `part`: which of the maps; of several components the main one.
std::vector<PlaceViews> find_place_views(const maps::StoredMaps& maps, std::size_t part,
                                         const std::vector<Eigen::Vector3d>& places,
                                         const core::Executor& executor);

}  // namespace plumbline::adjust
