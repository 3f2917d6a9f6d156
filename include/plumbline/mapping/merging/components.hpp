// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The components of one robot's map (docs/method/components.md): when one begins, where two show the same
// place, and where one is divided again.
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
#include "plumbline/sensor/frame.hpp"

namespace plumbline::mapping {

/// Frames in a row that are lost before a new component begins: half a second of a common camera.
constexpr int kLostFrames = 15;

/// True if a frame may begin a map: it must have depth for landmarks and surfaces. If the camera was covered,
/// all later frames would be lost.
bool can_begin_map(const sensor::RgbdFrame& frame);
/// True if a frame may begin a component: it must show enough to track the next ones, so not the dark, a hand
/// or a bare wall.
bool can_begin_component(const sensor::RgbdFrame& frame, const features::FrameFeatures& features);

/// Two components that show the same place.
struct ComponentOverlap {
  core::KeyframeId a;  ///< roots, a < b
  core::KeyframeId b;
  MergeEvidence evidence;  ///< its alignment leads from b's world to a's
};

/// Two components that were joined while the robot mapped.
struct ComponentJoin {
  ComponentOverlap overlap;
  double stamp = 0.0;         ///< stamp of the keyframe that made it certain, seconds
  std::size_t keyframes = 0;  ///< number of keyframes of the later component
};

/// Joins components that show the same place: keyframes of one are compared with those of the other, with the
/// same verification and decision as for maps of two robots. Divides a component where a relocalisation was
/// wrong.
class Components {
 public:
  /// The executor must outlive this.
  Components(const sensor::Pinhole& camera, const core::Executor& executor)
      : camera_(camera), executor_(&executor) {}

  /// Compares a keyframe with similar ones of other components, found in `places`. A returned overlap is
  /// certain; none as long as it is not.
  std::optional<ComponentOverlap> look_up(const maps::Map& map, core::KeyframeId keyframe,
                                          const places::Database& places);
  /// Moves the component that began later into the frame of the other one, and closes the loop between them.
  /// False, and nothing is changed, if the pose graph rejects what joins them. `keyframe`: that made the
  /// overlap certain. No work on data that was taken from the map before may be running.
  bool join(maps::Map& map, ComponentOverlap overlap, core::KeyframeId keyframe, LoopCloser& loops);

  /// `first` was made when the camera had been found again.
  void found_again(core::KeyframeId first) { relocalised_.push_back(first); }
  /// The first keyframe after a relocalisation that these loops agree against; none: there is none between
  /// them.
  [[nodiscard]] std::optional<core::KeyframeId> wrong_turn(const maps::Map& map,
                                                           const LoopDispute& dispute) const;
  /// Makes the keyframes from a wrong_turn() on a component of their own, which the loops may join again.
  void divide(maps::Map& map, core::KeyframeId first, const LoopDispute& dispute);

  [[nodiscard]] const std::vector<ComponentJoin>& joins() const { return joins_; }
  /// Relocalisations that were taken back because loops agreed against them.
  [[nodiscard]] int taken_back() const { return taken_back_; }

 private:
  using Roots = std::pair<core::KeyframeId, core::KeyframeId>;
  struct Pairs {
    std::vector<VerifiedPair> verified;
    std::size_t decided = 0;  ///< when it was decided last
  };
  void verify(const maps::Map& map, core::KeyframeId keyframe, core::KeyframeId root,
              const places::Database& places);
  void rename(core::KeyframeId a, core::KeyframeId b);

  sensor::Pinhole camera_;
  const core::Executor* executor_;
  MapFusionOptions options_;
  std::map<Roots, Pairs> pairs_;
  std::vector<ComponentJoin> joins_;
  std::vector<core::KeyframeId> relocalised_;  ///< the first keyframe after each time, ascending
  int taken_back_ = 0;
};

}  // namespace plumbline::mapping
