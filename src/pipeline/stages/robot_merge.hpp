// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Maps of several robots as one map result, with what is to be said of it.
#include <memory>
#include <string>
#include <vector>

#include "plumbline/core/log.hpp"
#include "plumbline/mapping/map_fusion.hpp"
#include "plumbline/pipeline/data.hpp"
#include "plumbline/pipeline/summary.hpp"

namespace plumbline::pipeline {

struct MergedRobots {
  std::shared_ptr<MapResult> map;  ///< with the components that stay apart
  std::vector<RunSummary::Merge> merges;
  std::string unconnected;  ///< which maps are left out and what was tried; empty: none
  std::size_t refused = 0;  ///< adjustments that would have torn a map
};

/// Fuses the parts that hang together with `anchor`; parts.size(): with the group that has most keyframes.
MergedRobots merge_robots(const std::vector<RobotMap>& parts, std::size_t anchor,
                          const mapping::MapFusionOptions& options, const core::Executor& executor,
                          core::Log& log);

}  // namespace plumbline::pipeline
