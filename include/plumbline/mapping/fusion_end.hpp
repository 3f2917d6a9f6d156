// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Finds while robots map where their maps overlap (METHOD section 6, Algorithm 2): looks up every new keyframe
// among those of the other robots, verifies what is similar, and tells when two maps certainly overlap.
#include <cstddef>
#include <map>
#include <utility>
#include <vector>

#include "plumbline/core/executor.hpp"
#include "plumbline/mapping/map_fusion.hpp"

namespace plumbline::mapping {

class FusionEnd {
 public:
  /// `parts`: the robots' maps, part r holding robot r. They may grow, and must live as long as this.
  FusionEnd(const MapFusionOptions& options, std::vector<MapPart> parts, const core::Executor& executor);

  /// Looks up a keyframe that has come to the map of its robot. Overlaps that have become certain with it, each
  /// pair of robots once. Throws std::invalid_argument: no such robot or keyframe.
  std::vector<MergeEvidence> add(core::KeyframeId keyframe);

 private:
  MapFusionOptions options_;
  const core::Executor* executor_;
  std::vector<MapPart> parts_;          ///< by robot
  std::vector<core::KeyframeId> last_;  ///< by robot
  OverlapFinder finder_;
  std::map<std::pair<std::size_t, std::size_t>, std::vector<VerifiedPair>> verified_;
  std::map<std::pair<std::size_t, std::size_t>, bool> merged_;
};

}  // namespace plumbline::mapping
