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

/// What one recording or one store gives.
struct RobotPart {
  std::string name;
  mapping::MapPart map;
  std::vector<RobotInfo> robots;
  const std::vector<maps::FramePose>* frames = nullptr;
};

struct MergedRobots {
  std::shared_ptr<const MapResult> map;
  std::vector<RunSummary::Merge> merges;
  std::string unconnected;  ///< which maps are left out and what was tried; empty: none
  std::size_t refused = 0;  ///< adjustments that would have torn a map
};

/// mapping::learn_places of the parts: can be done beside other work.
mapping::OverlapFinder learn_places(const std::vector<RobotPart>& parts,
                                    const mapping::MapFusionOptions& options);

/// Fuses the parts that hang together with `anchor`; parts.size(): with the group that has most keyframes.
/// `places`: of learn_places, for once.
MergedRobots merge_robots(const std::vector<RobotPart>& parts, mapping::OverlapFinder& places,
                          std::size_t anchor, const mapping::MapFusionOptions& options,
                          const core::Executor& executor, core::Log& log);

}  // namespace plumbline::pipeline
