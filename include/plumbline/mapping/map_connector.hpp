// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Puts measurements that were made in the background into the map at fixed frames, whatever the clock says.
#include <cstdint>
#include <deque>
#include <optional>
#include <utility>

#include "plumbline/core/executor.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/mapping/adjustment/background_bundle.hpp"
#include "plumbline/mapping/merging/components.hpp"
#include "plumbline/mapping/slam_options.hpp"

namespace plumbline::mapping {

/// The camera in a map that changes: it keeps its pose relative to its reference keyframe.
struct MapPosition {
  core::KeyframeId reference;
  geometry::Rigid3 camera_from_world;
  bool map_changed = false;  ///< what was taken from the map around it is out of date

  [[nodiscard]] geometry::Rigid3 camera_from_reference(const maps::Map& map) const {
    return camera_from_world * map.camera_from_world(reference).inverse();
  }
  /// The map has changed; the pose relative to the reference has not.
  void move(const maps::Map& map, const geometry::Rigid3& camera_from_reference) {
    camera_from_world = camera_from_reference * map.camera_from_world(reference);
    map_changed = true;
  }
};

/// Connects new keyframes with the rest of the map: aligned surfaces, loops, components, local bundles.
class MapConnector {
 public:
  /// Options, executor and log must outlive this.
  MapConnector(const SlamOptions& options, const sensor::Pinhole& camera, const core::Executor& executor,
               core::Log& log);

  /// Continues with the map of another one, whose newest keyframe is `newest`, made at its frame `frame`.
  void restore(const maps::Map& map, core::KeyframeId newest, std::int64_t frame);

  /// To be called before each frame: does what is due, or everything that is under way if `all`. Returns what
  /// became of a bundle.
  BundleReport begin_frame(maps::Map& map, MapPosition& camera, bool all);
  /// Knows the first keyframe of the map.
  void add_first(const maps::Map& map, core::KeyframeId keyframe) {
    if (options_.loops.enabled) loops_.detect(map, keyframe);
  }
  /// Takes a new keyframe, whose surfaces are being aligned in the background; none: they are not wanted.
  void add(core::KeyframeId keyframe, std::optional<SurfaceEdgeJob> edges) {
    waiting_.push_back({keyframe, frame_, std::move(edges)});
  }
  /// Connects the oldest keyframe that waits, if bundles are adjusted on the spot.
  void connect_at_once(maps::Map& map, MapPosition& camera, BundleReport& report);
  /// Waits for all that is under way.
  void finish(maps::Map& map, MapPosition& camera);
  /// True if nothing is under way.
  [[nodiscard]] bool idle() const { return waiting_.empty() && bundle_.idle(); }

  [[nodiscard]] LoopCloser& loops() { return loops_; }
  [[nodiscard]] const LoopCloser& loops() const { return loops_; }
  [[nodiscard]] Components& components() { return components_; }
  [[nodiscard]] const Components& components() const { return components_; }
  /// Bundles and loops that would have torn the map, and were not put into it.
  [[nodiscard]] int refused() const { return bundle_.refused() + loops_.counts().refused; }

 private:
  struct NewKeyframe {
    core::KeyframeId id;
    std::int64_t frame = 0;  ///< of frame_, with which it was made
    std::optional<SurfaceEdgeJob> edges;
  };
  void connect(maps::Map& map, MapPosition& camera, BundleReport& report);
  void close_loops(maps::Map& map, core::KeyframeId keyframe, MapPosition& camera);
  bool divide(maps::Map& map, MapPosition& camera);
  void join(maps::Map& map, core::KeyframeId keyframe, MapPosition& camera);
  void put_back_bundle(maps::Map& map, MapPosition& camera, BundleReport& report);
  void commit_bundles(maps::Map& map, MapPosition& camera);

  const SlamOptions& options_;
  BackgroundBundle bundle_;
  LoopCloser loops_;
  Components components_;
  std::deque<NewKeyframe> waiting_;  ///< the oldest first
  std::int64_t frame_ = 0;           ///< logical time
};

}  // namespace plumbline::mapping
