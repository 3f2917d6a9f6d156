// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Observer of a map while it is made: shows it, or sends it on. It never changes a result.
#include <cstdint>
#include <string>
#include <vector>

#include "plumbline/cloud/types.hpp"
#include "plumbline/geometry/trajectory.hpp"
#include "plumbline/pipeline/live_pose.hpp"

namespace plumbline::pipeline {

/// Called by stages, from several threads at a time; must return quickly. What is not overridden is ignored.
/// Poses are in the frame of the map of `robot`, as it is at that moment; metres.
class RunObserver {
 public:
  virtual ~RunObserver() = default;
  /// Called first, and whenever a robot joins; the robots' names, by number.
  virtual void begins(const std::vector<std::string>& /*robots*/) {}
  /// For several robots: the pose of one robot's map in the frame that it shares with others.
  virtual void placed(std::int32_t /*robot*/, double /*stamp*/, const geometry::Rigid3& /*shared_from_map*/) {
  }
  /// A tracked frame, in the order of frames. `odometry_from_camera` is the pose on the same path without
  /// corrections by loops and adjustments: it never jumps.
  virtual void tracked(std::int32_t /*robot*/, double /*stamp*/, const geometry::Rigid3& /*map_from_camera*/,
                       const geometry::Rigid3& /*odometry_from_camera*/) {}
  /// Every frame, in the order of frames.
  virtual void processed(const LivePose& /*pose*/) {}
  /// After each keyframe: the poses of all, by stamp.
  virtual void keyframes(std::int32_t /*robot*/, const geometry::Trajectory& /*path*/) {}
  /// The cloud of a keyframe, in any order; points that are not finite are to be ignored.
  virtual void added(std::int32_t /*robot*/, double /*stamp*/, const geometry::Rigid3& /*map_from_cloud*/,
                     const cloud::Cloud& /*cloud*/) {}
  /// Called when all is done, with the tracked frames of each robot, by number, and the merged cloud, all in
  /// one frame: that of the map of a robot alone, else the one in which the robots' maps were merged.
  virtual void finished(const std::vector<geometry::Trajectory>& /*paths*/,
                        const geometry::Rigid3& /*map_from_cloud*/, const cloud::Cloud& /*cloud*/) {}
};

}  // namespace plumbline::pipeline
