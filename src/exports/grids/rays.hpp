// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The rays of a map's views.
#include <functional>

#include "plumbline/maps/view_rays.hpp"
#include "source/map_source.hpp"

namespace plumbline::exports {

using maps::ForEachView;
using maps::ViewRays;

/// Calls `take` with the rays of each view of the map, in order; of each view about one ray in 6 x 6 pixels.
/// Progress is reported. Errors (kInput): no map.db, or damaged; those of `take`.
core::Result<void> for_each_view(const MapSource& source,
                                 const std::function<core::Result<void>(const ViewRays&)>& take);

}  // namespace plumbline::exports
