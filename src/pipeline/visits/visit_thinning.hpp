// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Keyframes of a visit that are kept, so that ten visits of a room cost the memory of the room.
#include <map>
#include <set>

#include "plumbline/core/options.hpp"
#include "plumbline/maps/frame_pose.hpp"
#include "plumbline/maps/map.hpp"
#include "visit_changes.hpp"

namespace plumbline::pipeline {

struct ThinningOptions {
  bool thin = true;         ///< leave keyframes out at all
  double share_new = 0.25;  ///< keyframes with a larger share of new surface are kept
  int views = 5;            ///< else new surface is kept in so many keyframes
  int cells = 30;           ///< of which each adds at least so many cells
  double apart_m = 1.0;     ///< keyframes are kept that have none nearer than this
  double apart_rad = 0.7;   ///< or turned by less
  void declare(core::OptionTable& table);
};

/// The keyframes of `visitors` (robots) whose view the map holds without them. Of each robot the first one is
/// kept, a keyframe without a view, and roots. `views`: indices into `changes` by keyframe.
std::set<core::KeyframeId> redundant_keyframes(const maps::Map& map, const std::set<std::int32_t>& visitors,
                                               const std::map<core::KeyframeId, std::size_t>& views,
                                               const VisitChanges& changes, const ThinningOptions& options);

/// Makes frames relative to the nearest keyframe in time of the same robot, where theirs is among `gone`;
/// these no longer tell which points they saw.
void refer_to_others(const maps::Map& map, const std::set<core::KeyframeId>& gone,
                     std::vector<maps::FramePose>& frames);

/// Takes landmarks and pieces of surface that are gone out of the map, unless a visitor saw them.
void remove_gone(const VisitChanges& changes, const std::set<std::int32_t>& visitors, maps::Map& map);

}  // namespace plumbline::pipeline
