// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Merges maps while robots meet (docs/method/merging.md; Algorithm 2): every new keyframe is looked up among
// those of the other robots; similar ones are verified; once it is certain that two maps overlap, all
// connected maps are moved into one frame by a pose graph. That frame is updated as keyframes are added and
// move, further robots join it, and a merge is taken back if later evidence contradicts it. It is a preview:
// duplicate landmarks are not merged, surfaces not aligned; fuse_maps of the finished maps decides.
//
// Work runs beside the caller, by logical time: a job that is started at frame k is committed at frame
// k + lag, independent of the clock. So the same calls give the same events for any number of threads.
// A frame is the number of a frame of the run, or whatever else the caller counts by.
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "plumbline/core/executor.hpp"
#include "plumbline/mapping/merging/map_fusion.hpp"

namespace plumbline::mapping {

/// Progress of the meeting of two robots (Fig. 3 of the paper).
enum class MeetingStep { kNone, kSimilar, kVerified, kLocalMapAsked, kMet, kTakenBack };

struct MeetingEvent {
  MeetingStep step = MeetingStep::kNone;
  std::size_t a = 0;  ///< number of the first robot; a < b
  std::size_t b = 0;
  std::int64_t frame = 0;                   ///< frame at which the keyframe was added
  core::KeyframeId keyframe;                ///< keyframe that caused the step
  MergeEvidence evidence;                   ///< evidence for kMet and kTakenBack
  std::shared_ptr<const FusedMap> preview;  ///< for kMet: all maps connected now; its parts are robots
};

/// Pose of a robot in the frame that it shares with others.
struct RobotPlace {
  std::size_t anchor = 0;              ///< robot whose world is the common frame: the first of those that met
  geometry::Rigid3 anchor_from_robot;  ///< relative pose of the worlds
  geometry::Rigid3 anchor_from_camera;  ///< pose of the newest keyframe
  /// Covariance of that camera's position (metres) and rotation (radians), from the merges between it and the
  /// anchor, in the anchor's axes; drift of the robots' own maps is not in it.
  geometry::Matrix6d covariance = geometry::Matrix6d::Zero();
};

class MergeServer {
 public:
  /// `lag`: frames between taking keyframes and committing their results. The executor must
  /// outlive this.
  MergeServer(const MapFusionOptions& options, int lag, const core::Executor& executor);

  /// Adds a robot; robots are numbered 0, 1, ..., in the ids of their maps too.
  std::size_t join(const Cameras& cameras);

  /// Adds a keyframe that is new in `map`, the map of its robot, at a frame; frames never decrease. Throws
  /// std::invalid_argument: no such robot or keyframe.
  void add(std::shared_ptr<const maps::Map> map, core::KeyframeId keyframe, std::int64_t frame);
  /// Events that are to be committed at this frame; mostly none. To be called for every frame, after add().
  std::vector<MeetingEvent> commit(std::int64_t frame);
  /// All remaining events, after the last frame.
  std::vector<MeetingEvent> finish();

  /// Pose of the robot as of the last commit; none if it has met no other robot.
  [[nodiscard]] std::optional<RobotPlace> place(std::size_t robot) const;

 private:
  struct NewKeyframe {
    std::shared_ptr<const maps::Map> map;
    core::KeyframeId id;
    std::int64_t frame = 0;
  };
  /// All evidence on two robots.
  struct RobotPair {
    MeetingStep step = MeetingStep::kNone;  ///< latest step that was reported
    bool met = false;
    std::vector<VerifiedPair> verified;
    std::size_t decided_pairs = 0;      ///< number of pairs at the last decision
    std::size_t decided_keyframes = 0;  ///< number of keyframes at the last decision
    MergeEvidence evidence;             ///< evidence of the last decision, if the robots have met
    core::KeyframeId a;                 ///< keyframe of the pair that fixes the alignment while the maps move
    core::KeyframeId b;
    geometry::Rigid3 a_from_b;  ///< relative pose of the two cameras
  };
  /// Data of the background work while it runs.
  struct Work {
    std::vector<std::shared_ptr<const maps::Map>> maps;  ///< by robot, newest version
    std::vector<MapPart> parts;                          ///< the same maps as parts
    OverlapFinder finder;
    std::map<std::pair<std::size_t, std::size_t>, RobotPair> pairs;
    std::vector<MeetingEvent> events;
    std::vector<std::optional<RobotPlace>> places;  ///< by robot
  };
  using Robots = std::pair<std::size_t, std::size_t>;

  void begin(std::int64_t frame);
  std::vector<MeetingEvent> put_back();
  void look_up(const NewKeyframe& keyframe);
  void verify(const std::vector<OverlapFinder::Candidate>& candidates, const NewKeyframe& keyframe);
  void reach(const Robots& robots, MeetingStep step, const NewKeyframe& keyframe);
  [[nodiscard]] bool worth_deciding(const Robots& robots) const;
  void decide(const Robots& robots, const NewKeyframe& keyframe);
  void meet(const Robots& robots, const NewKeyframe& keyframe);
  void take_back(const Robots& robots, const MergeEvidence& evidence, const NewKeyframe& keyframe);
  [[nodiscard]] std::vector<MergeEvidence> merges() const;
  void update_places();

  MapFusionOptions options_;
  int lag_;
  const core::Executor* executor_;
  Work work_;
  std::vector<NewKeyframe> waiting_;  ///< keyframes that wait until the current work is done
  std::vector<std::optional<RobotPlace>> places_;
  bool busy_ = false;
  std::int64_t due_ = 0;
  core::Executor::Job job_;  ///< last: its destructor waits before the rest is destroyed
};

}  // namespace plumbline::mapping
