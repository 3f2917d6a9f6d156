// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "plumbline/features/frame_features.hpp"

namespace plumbline::mapping {

/// Points of two images that look like each other and like no other: each is the other's nearest by
/// descriptor, clearly nearer than whatever lies at another place of its image. By index in `a`.
std::vector<std::pair<std::size_t, std::size_t>> alike_both_ways(const features::FrameFeatures& a,
                                                                 const features::FrameFeatures& b);

}  // namespace plumbline::mapping
