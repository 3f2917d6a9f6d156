// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Two maps joined by places that a person picked in both.
#include <vector>

#include "plumbline/mapping/merging/map_fusion.hpp"
#include "plumbline/pipeline/data.hpp"

namespace plumbline::pipeline {

/// The merge of `parts`, the components of `maps`, that their picks tell: a turn about the vertical and a
/// shift. Where the picks leave the turn open, walls of both are taken for square. Errors (kUsage): too few
/// picks, they contradict each other, nobody saw one; a map is not upright.
core::Result<mapping::MergeEvidence> picked_merge(const maps::StoredMaps& maps,
                                                  const std::vector<RobotMap>& parts,
                                                  const core::Executor& executor);

}  // namespace plumbline::pipeline
