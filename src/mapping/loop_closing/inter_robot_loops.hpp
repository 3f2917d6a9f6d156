// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Loops through other robots' maps. A keyframe that shows a place which another robot has seen too gives
// the relative pose of the two worlds there; two such keyframes, an early and a late one, are connected
// through the other robot's map.
#include <memory>
#include <optional>
#include <vector>

#include "plumbline/mapping/loop_closing/loop_closer.hpp"

namespace plumbline::mapping {

class InterRobotLoops {
 public:
  InterRobotLoops(const LoopOptions& options, const sensor::Pinhole& camera,
                  std::shared_ptr<const OtherMapsInbox> inbox)
      : options_(options), camera_(camera), inbox_(std::move(inbox)) {}

  /// camera_from_world of the only keyframe of `image`, in the world of this robot. The database holds its
  /// own keyframes, and gets the others' as they arrive.
  std::optional<geometry::Rigid3> locate(places::Database& database, const maps::Map& image);
  /// Loops between keyframes of the robot's own map that ended at `keyframe`: those that contradict their
  /// present poses by more than their own errors explain.
  std::vector<Loop> detect(places::Database& database, const maps::Map& map, core::KeyframeId keyframe);

 private:
  void update(places::Database& database);
  [[nodiscard]] std::optional<Loop> recognise(const places::Database& database, const maps::Map& map,
                                              core::KeyframeId keyframe) const;
  [[nodiscard]] std::optional<Loop> by_way_of(const maps::Map& map, const Loop& early, const Loop& late,
                                              double& chi2) const;

  LoopOptions options_;
  sensor::Pinhole camera_;
  std::shared_ptr<const OtherMapsInbox> inbox_;
  std::shared_ptr<const OtherMaps> others_;
  PendingLoops pending_;
  std::vector<Loop> sightings_;  ///< queries of the own map, matches of others'; confirmed
};

}  // namespace plumbline::mapping
