// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Finds the relative pose of two components of one robot's map (docs/method/components.md): keyframes of one
// are compared with those of the other, with the same verification and decision as for maps of two robots.
#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "plumbline/core/executor.hpp"
#include "plumbline/mapping/loop_closing/loop_closer.hpp"
#include "plumbline/mapping/merging/map_fusion.hpp"
#include "plumbline/maps/map.hpp"
#include "plumbline/places/recogniser.hpp"
#include "plumbline/sensor/camera.hpp"

namespace plumbline::mapping {

/// Two components that show the same place.
struct ComponentOverlap {
  core::KeyframeId a;  ///< roots, a < b
  core::KeyframeId b;
  MergeEvidence evidence;  ///< its alignment leads from b's world to a's
};

class ComponentJoiner {
 public:
  /// The executor must outlive this.
  ComponentJoiner(const sensor::Pinhole& camera, const core::Executor& executor)
      : camera_(camera), executor_(&executor) {}

  /// Compares a keyframe with similar ones of other components, found in `places`. A returned overlap is
  /// certain; none as long as it is not.
  std::optional<ComponentOverlap> look_up(const maps::Map& map, core::KeyframeId keyframe,
                                          const places::Database& places);
  /// Pairs of keyframes of different components that were verified elsewhere; look_up() decides about them.
  void add(const maps::Map& map, const std::vector<Loop>& verified);
  /// The component of root `b` became part of that of root `a`.
  void joined(core::KeyframeId a, core::KeyframeId b);

 private:
  using Roots = std::pair<core::KeyframeId, core::KeyframeId>;
  struct Pairs {
    std::vector<VerifiedPair> verified;
    std::size_t decided = 0;  ///< when it was decided last
  };
  void verify(const maps::Map& map, core::KeyframeId keyframe, core::KeyframeId root,
              const places::Database& places);

  sensor::Pinhole camera_;
  const core::Executor* executor_;
  MapFusionOptions options_;
  std::map<Roots, Pairs> pairs_;
};

}  // namespace plumbline::mapping
