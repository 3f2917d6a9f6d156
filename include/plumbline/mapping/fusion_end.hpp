// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The end that fuses while robots map (METHOD section 6, Algorithm 2): it gets a message of every new
// keyframe, asks the dictionary for the place among the keyframes of the other robots, and tells when two
// maps certainly overlap. It knows of the robots what the messages say and nothing else.
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/core/executor.hpp"
#include "plumbline/mapping/map_fusion.hpp"
#include "plumbline/maps/keyframe_message.hpp"

namespace plumbline::mapping {

class FusionEnd {
 public:
  /// `robots`: how many there are; their numbers are 0, 1, ...
  FusionEnd(const MapFusionOptions& options, std::size_t robots, const core::Executor& executor);

  /// Bytes of maps::encode_message. Overlaps that have become certain with this keyframe, each once. Errors
  /// (kInput): the bytes are damaged, or of a robot that is not known, or a keyframe comes twice.
  core::Result<std::vector<MergeEvidence>> receive(const std::vector<std::uint8_t>& message);

  struct Traffic {
    std::size_t messages = 0;
    std::size_t bytes = 0;
    std::size_t most = 0;  ///< bytes of the largest message
  };
  [[nodiscard]] const Traffic& traffic(std::size_t robot) const { return traffic_[robot]; }
  /// What it knows of a robot's map.
  [[nodiscard]] const maps::Map& map(std::size_t robot) const { return *maps_[robot]; }

 private:
  void add(const maps::KeyframeMessage& message);

  MapFusionOptions options_;
  const core::Executor* executor_;
  std::vector<std::unique_ptr<maps::Map>> maps_;  ///< by robot
  std::vector<MapPart> parts_;
  std::vector<core::KeyframeId> last_;                         ///< by robot
  std::vector<std::map<std::int32_t, core::PointId>> points_;  ///< by robot: its number to ours
  std::vector<std::map<std::int32_t, core::LineId>> lines_;
  OverlapFinder finder_;
  std::map<std::pair<std::size_t, std::size_t>, std::vector<VerifiedPair>> verified_;
  std::map<std::pair<std::size_t, std::size_t>, bool> merged_;
  std::vector<Traffic> traffic_;
};

}  // namespace plumbline::mapping
