// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A part of a map as a map of its own.
#include <set>

#include "plumbline/maps/map.hpp"

namespace plumbline::maps {

/// The map without these keyframes, none of which is a root: their children are attached to the nearest
/// ancestor that stays, and landmarks that only they saw are left out.
[[nodiscard]] Map without(const Map& map, const std::set<core::KeyframeId>& keyframes);

}  // namespace plumbline::maps
