// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Maps of several robots as one map result, with its summary.
#include <memory>
#include <string>
#include <vector>

#include "plumbline/core/log.hpp"
#include "plumbline/mapping/merging/map_fusion.hpp"
#include "plumbline/pipeline/data.hpp"
#include "summary/sections.hpp"

namespace plumbline::pipeline {

/// Comparison of two maps.
struct RobotMerge {
  std::string a;
  std::string b;
  double time_s = -1.0;  ///< time in the recordings, if it happened while mapping; negative: afterwards
  /// Time at which the fifth agreeing keyframe existed on both sides, or the last one if there are fewer;
  /// negative: not known.
  double evident_s = -1.0;
  mapping::MergeEvidence evidence;
  bool by_rig = false;  ///< the two are cameras that are fixed to each other
};
Json section_of(const RobotMerge& merge);

struct MergedRobots {
  std::shared_ptr<MapResult> map;  ///< merged map, with the components that stay apart
  std::vector<RobotMerge> merges;
  std::string unconnected;  ///< text on which maps are left out and what was tried; empty: none
  std::size_t refused = 0;  ///< number of adjustments that would have torn a map
};

/// A merge that is known from elsewhere than the places that both maps show.
struct KnownMerge {
  enum class By { kPicks, kRig };
  mapping::MergeEvidence evidence;
  By by = By::kPicks;
};

/// Fuses the parts that are connected with `anchor`; if that is parts.size(), the connected group that has
/// most keyframes. `known`: picks replace what places show; pairs of a rig join
/// those of places that agree with it.
MergedRobots merge_robots(const std::vector<RobotMap>& parts, std::size_t anchor,
                          const mapping::MapFusionOptions& options, const core::Executor& executor,
                          core::Log& log, const std::vector<KnownMerge>& known = {});

/// The first part as it is, the others apart. `state`: its covariances, by number of robot and stamp.
std::shared_ptr<MapResult> kept_map(const std::vector<RobotMap>& parts, const maps::FusionState& state);

}  // namespace plumbline::pipeline
