// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Finds while robots map where their maps overlap (docs/method/merging.md; Algorithm 2): looks up every new
// keyframe among those of the other robots, verifies what is similar, and tells when two maps certainly
// overlap.
#include <cstddef>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "plumbline/core/executor.hpp"
#include "plumbline/mapping/map_fusion.hpp"

namespace plumbline::mapping {

class MergeServer {
 public:
  /// `cameras`: of the robots, which are numbered 0, 1, ...
  MergeServer(const MapFusionOptions& options, const std::vector<Cameras>& cameras,
              const core::Executor& executor);

  /// Looks up a keyframe that is new in `map`, its robot's. Overlaps that have become certain with it, each
  /// pair of robots once. Throws std::invalid_argument: no such robot or keyframe.
  std::vector<MergeEvidence> add(std::shared_ptr<const maps::Map> map, core::KeyframeId keyframe);

 private:
  MapFusionOptions options_;
  const core::Executor* executor_;
  std::vector<std::shared_ptr<const maps::Map>> maps_;  ///< by robot, as each was told last
  std::vector<MapPart> parts_;                          ///< the same
  std::vector<core::KeyframeId> last_;                  ///< by robot
  OverlapFinder finder_;
  std::map<std::pair<std::size_t, std::size_t>, std::vector<VerifiedPair>> verified_;
  std::map<std::pair<std::size_t, std::size_t>, bool> merged_;
};

}  // namespace plumbline::mapping
