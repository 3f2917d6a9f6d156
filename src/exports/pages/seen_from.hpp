// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Which keyframe saw what best.
#include <map>
#include <vector>

#include "source/map_source.hpp"

namespace plumbline::exports {

/// For each point of the cloud the number of the keyframe whose depth image has something there, from nearest
/// by and least aslant; NaN: none has. `numbers`: of the keyframes. Empty: the map holds no clouds of
/// keyframes. Errors (kInput): damaged.
core::Result<std::vector<float>> best_views(const MapSource& source, const cloud::CloudFile& file,
                                            const std::map<core::KeyframeId, std::size_t>& numbers);

}  // namespace plumbline::exports
