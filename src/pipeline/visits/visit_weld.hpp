// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The poses of an earlier map stay where they were when a visit is joined to it.
#include <cstdint>
#include <set>

#include "plumbline/pipeline/data.hpp"

namespace plumbline::pipeline {

/// Moves the keyframes that `earlier` has back to where they are there. Every keyframe of `visitors` (robots)
/// goes along with the one of these that it shares most with; if it shares nothing, with the keyframe before
/// it. False, and nothing is moved: adjustment has moved some by 3 cm or more, because the visit closes a new
/// loop.
bool hold_earlier(const maps::Map& earlier, const std::set<std::int32_t>& visitors, MapResult& map);

}  // namespace plumbline::pipeline
