// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Time from which the meeting of two robots could have been detected.
#include <algorithm>
#include <cstdint>
#include <map>
#include <vector>

#include "plumbline/mapping/merging/map_fusion.hpp"

namespace plumbline::mapping {

/// Time at which the agreeing pairs covered five keyframes on both sides, or all if there are fewer;
/// negative: not known. `made`: times at which keyframes were made; a pair exists when both of its keyframes
/// do.
inline double evident_s(const MergeEvidence& merge, const std::map<core::KeyframeId, double>& made) {
  constexpr std::size_t kEnough = 5;

  // The time at which each keyframe was first in a pair.
  std::map<core::KeyframeId, double> paired;
  for (const VerifiedPair& pair : merge.pairs) {
    const auto query = made.find(pair.query);
    const auto match = made.find(pair.match);
    if (query == made.end() || match == made.end()) continue;
    const double both = std::max(query->second, match->second);
    for (const core::KeyframeId id : {pair.query, pair.match}) {
      const auto known = paired.emplace(id, both).first;
      known->second = std::min(known->second, both);
    }
  }

  // The time at which each robot had enough of them: the later one counts.
  std::map<std::int32_t, std::vector<double>> sides;
  for (const auto& [id, time] : paired) sides[id.robot].push_back(time);
  double latest = -1.0;
  for (auto& [robot, times] : sides) {
    std::sort(times.begin(), times.end());
    latest = std::max(latest, times[std::min(kEnough, times.size()) - 1]);
  }
  return latest;
}

}  // namespace plumbline::mapping
