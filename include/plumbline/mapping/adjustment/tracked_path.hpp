// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The path from keyframe to keyframe as measured by the tracker, which adjustments of the map must not
// contradict.
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "plumbline/maps/map.hpp"

namespace plumbline::mapping {

/// New poses of keyframes: camera_from_world.
using KeyframePoses = std::vector<std::pair<core::KeyframeId, geometry::Rigid3>>;

/// Two neighbours on the path that new poses would tear apart.
struct Contradiction {
  core::KeyframeId a;
  core::KeyframeId b;
  double off_m = 0.0;  ///< difference from the tracker's measurement
  double off_rad = 0.0;
  [[nodiscard]] std::string text() const;
};

/// Worst contradiction between `poses` and what the tracker measured between a keyframe and the one it
/// followed then: beyond noise (maps::beyond_noise), and larger than in the map as it is. None: the poses may
/// be put into the map. A correction that is spread over the path, as a loop's is, contradicts nothing.
std::optional<Contradiction> contradiction(const maps::Map& map, const KeyframePoses& poses);

}  // namespace plumbline::mapping
