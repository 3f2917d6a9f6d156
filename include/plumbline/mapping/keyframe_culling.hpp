// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Keyframes whose neighbours see all that they see.
#include <vector>

#include "plumbline/core/options.hpp"
#include "plumbline/maps/map.hpp"

namespace plumbline::mapping {

struct KeyframeCullingOptions {
  double redundant_share = 0.9;  ///< of its landmarks that enough others see as sharply
  double covered_share = 0.9;    ///< of its surface that others measured
  int others = 3;                ///< keyframes that must see a landmark
  int surface_others = 2;        ///< keyframes that must have measured a piece of surface
  int keep_last = 4;             ///< keyframes before the newest that are not judged yet
  int candidates = 12;           ///< neighbours of the newest that are judged

  void declare(core::OptionTable& table);
};

/// Share of the landmarks of `id` that at least `others` other keyframes see at the same or a finer scale
/// (lines: at least as long). 1 without any landmark.
double redundant_landmarks(const maps::Map& map, core::KeyframeId id, int others);

/// Share of the surface samples of `id` near which (in the same 15 cm of space) at least `others` of
/// `neighbours` have samples. 1 without any sample.
double covered_surface(const maps::Map& map, core::KeyframeId id,
                       const std::vector<core::KeyframeId>& neighbours, int others);

/// Judges the neighbours of the keyframe made last and takes the redundant ones out of the map, one after the
/// other. Both landmarks and surface must be there without it: tracking holds on to either. The first
/// keyframe of a robot stays, it holds the map's place. The dense cloud of a keyframe that goes is not lost:
/// the map still knows its pose, which moves with the keyframe that took its place (Map::pose_of). Returns
/// what went.
std::vector<core::KeyframeId> cull_keyframes(maps::Map& map, core::KeyframeId newest,
                                             const KeyframeCullingOptions& options);

}  // namespace plumbline::mapping
