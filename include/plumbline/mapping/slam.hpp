// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// One robot's SLAM: frames in, poses and a map out. The loop of sections 3 and 4 of Xia, Wu, Ma, Zhu, Cheng,
// Zhu, "Multi-Robot Collaborative Mapping with Integrated Point-Line Features for Visual SLAM", Sensors 2024,
// 24(17), 5743. Bundles are adjusted beside the tracker; what comes out is the same for any number of
// threads.
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "plumbline/core/executor.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/core/options.hpp"
#include "plumbline/features/frame_features.hpp"
#include "plumbline/geometry/trajectory.hpp"
#include "plumbline/mapping/adjustment/background_bundle.hpp"
#include "plumbline/mapping/adjustment/map_recalibration.hpp"
#include "plumbline/mapping/frame_trajectory.hpp"
#include "plumbline/mapping/local_mapping/keyframe_rule.hpp"
#include "plumbline/mapping/local_mapping/local_mapper.hpp"
#include "plumbline/mapping/loop_closing/loop_closer.hpp"
#include "plumbline/mapping/loop_closing/relocalisation_check.hpp"
#include "plumbline/mapping/merging/component_joiner.hpp"
#include "plumbline/maps/map.hpp"
#include "plumbline/tracking/tracker.hpp"

namespace plumbline::mapping {

struct SlamOptions {
  tracking::TrackerOptions tracker;
  KeyframeRuleOptions keyframe;
  LocalMapperOptions mapper;
  int bundle_lag = 8;  ///< frames
  LoopOptions loops;
  bool components = true;
  void declare(core::OptionTable& table);
};

/// Report of one frame; one line of frames.csv.
struct FrameReport {
  std::int64_t frame_index = -1;
  double stamp = 0.0;
  tracking::TrackState state = tracking::TrackState::kLost;
  core::KeyframeId reference;  ///< keyframe the pose is relative to
  core::KeyframeId keyframe;   ///< made of this frame; invalid: none
  core::KeyframeId component;  ///< root of the component at the time of tracking; invalid: in none
  optimize::FamilySummary points;
  optimize::FamilySummary lines;
  optimize::FamilySummary surface;
  optimize::FamilySummary photometric;
  double min_eigenvalue = 0.0;
  int degenerate_directions = 0;
  bool relocalised = false;
  geometry::Rigid3 depth_from_camera;  ///< motion between the stamps of colour and depth
  KeyframeDecision decision;
  BundleReport bundle;  ///< put back before this frame was tracked (with a lag of 0: after)
  static FrameReport of(const sensor::RgbdFrame& frame, const tracking::TrackResult& track);
};

/// Two components that were joined while the robot mapped.
struct ComponentJoin {
  ComponentOverlap overlap;
  double stamp = 0.0;         ///< stamp of the keyframe that made it certain, seconds
  std::size_t keyframes = 0;  ///< number of keyframes of the later component
};

class Slam {
 public:
  Slam(const SlamOptions& options, const sensor::Pinhole& camera, std::int32_t robot,
       const core::Executor& executor, core::Log& log);
  Slam(const Slam&) = delete;  // the tracker calls this object to check places
  Slam& operator=(const Slam&) = delete;

  /// Continues where another Slam stopped when it had just made a keyframe, with its map and frame_poses().
  /// To be called before the first frame. Background work is started again; landmarks on probation and places
  /// follow from the map. With a map without keyframes nothing happens.
  void restore(maps::Map map, std::vector<maps::FramePose> frames);

  /// Sets the camera that took the pictures from which rectified images are made: its shutter and lens. To be
  /// called before the first frame; without it they are those of the pinhole.
  void set_camera(const sensor::Camera& camera);
  /// Replaces the camera by a refined one. The map is rebuilt for it and adjusted (recalibrate_map), and
  /// later frames must have been read with that camera. `read`: reads pictures of keyframes again; may be
  /// empty.
  void recalibrate(const sensor::Camera& camera, const PictureReader& read);
  [[nodiscard]] const sensor::Camera& camera() const { return camera_; }
  [[nodiscard]] const sensor::Pinhole& image() const { return image_; }

  /// From now on maps of other robots are used for relocalisation and loops (without the option loops: for
  /// nothing). This map then depends on the received maps and their times.
  void use(std::shared_ptr<const OtherMapsInbox> others) {
    if (options_.loops.enabled) closer_.use(std::move(others));
  }

  /// Sensors of the body that carries the camera (tracking::Tracker::set_motion_sensor).
  void use(tracking::MotionSensor sensor) { tracker_.set_motion_sensor(std::move(sensor)); }

  using Features = std::shared_ptr<const features::FrameFeatures>;
  enum class Keyframe { kByRule, kYes, kNo };  ///< whether a frame becomes a keyframe
  /// Frames in order of time. The features are kept when the frame becomes a keyframe.
  FrameReport process(const sensor::RgbdFrame& frame, const Features& features,
                      Keyframe keyframe = Keyframe::kByRule);
  /// Ends the background work; call once, after the last frame.
  void finish();

  /// All components (maps/components.hpp).
  [[nodiscard]] const maps::Map& map() const { return map_; }
  [[nodiscard]] const std::vector<ComponentJoin>& joins() const { return joins_; }
  /// Loops that agree against the path, without a relocalisation between them that could be taken back.
  [[nodiscard]] const std::vector<LoopDispute>& disputes() const { return closer_.disputes(); }
  /// Relocalisations that were taken back because loops agreed against them.
  [[nodiscard]] int taken_back() const { return taken_back_; }
  [[nodiscard]] const LoopCounts& loop_counts() const { return closer_.counts(); }
  /// Bundles and loops that would have torn the map, and were not put into it.
  [[nodiscard]] int refused() const { return bundle_.refused() + closer_.counts().refused; }
  /// Every place that was verified, with its evidence.
  [[nodiscard]] const std::vector<LoopTrial>& loop_trials() const { return closer_.trials(); }
  /// Keyframes by appearance; empty without loops.
  [[nodiscard]] const places::Database& places() const { return closer_.database(); }
  /// The tracker's result for the last frame; for drawing it.
  [[nodiscard]] const tracking::TrackResult& last_track() const { return last_track_; }
  /// Every frame in order, relative to its keyframe.
  [[nodiscard]] const std::vector<maps::FramePose>& frame_poses() const { return frames_.poses(); }
  /// Replaces them, of the same recording, for a map that was made of some of its frames only.
  void set_frames(std::vector<maps::FramePose> frames) { frames_ = FrameTrajectory(std::move(frames)); }
  /// Poses after optimisation: tracked frames only, in order of time.
  [[nodiscard]] geometry::Trajectory trajectory() const;

 private:
  void start_map(const sensor::RgbdFrame& frame, const Features& features, FrameReport& report);
  /// True if the camera is believed to be where it was found again; as long as it is not, its frames have no
  /// pose.
  bool believes_place(const sensor::RgbdFrame& frame, const Features& features, int lost_before);
  void begin_component(const sensor::RgbdFrame& frame, const Features& features, FrameReport& report);
  void join_components(core::KeyframeId keyframe);
  void insert_keyframe(const sensor::RgbdFrame& frame, const Features& features, FrameReport& report);
  /// Puts the results of background work on a keyframe into the map, and begins the work that waited for it.
  void connect_keyframe(BundleReport& report);
  void set_reference(core::KeyframeId keyframe);
  void put_back_bundle(BundleReport& report);
  void connect_keyframes();
  void commit_bundles();
  void close_loops(core::KeyframeId keyframe);
  /// True if a relocalisation was taken back because of the newest dispute: the keyframes after it are now a
  /// component of their own.
  bool give_way();

  [[nodiscard]] std::shared_ptr<const maps::SeenPoints> seen_points() const;

  SlamOptions options_;
  const core::Executor& executor_;
  RelocalisationCheck relocalisation_;
  sensor::Pinhole image_;
  sensor::Camera camera_;
  maps::Map map_;
  tracking::Tracker tracker_;
  tracking::TrackResult last_track_;
  KeyframeRule keyframe_rule_;
  LocalMapper mapper_;
  BackgroundBundle bundle_;
  LoopCloser closer_;
  ComponentJoiner joiner_;
  std::vector<ComponentJoin> joins_;
  /// A new keyframe whose surfaces are being aligned beside the tracker.
  struct NewKeyframe {
    core::KeyframeId id;
    std::int64_t frame = 0;               ///< of frame_count_, with which it was made
    std::optional<SurfaceEdgeJob> edges;  ///< none: they are not wanted
  };
  std::deque<NewKeyframe> new_keyframes_;  ///< the oldest first
  /// A camera that was found again, but is not believed to be there yet.
  struct Probation {
    int lost_before = 0;  ///< frames in a row
    int frames = 0;       ///< since it was found
  };
  std::optional<Probation> probation_;
  bool found_again_ = false;                   ///< and no keyframe made since
  std::vector<core::KeyframeId> relocalised_;  ///< the first keyframe after each time, ascending
  int taken_back_ = 0;
  std::int64_t frame_count_ = 0;  ///< logical time
  FrameTrajectory frames_;
};

}  // namespace plumbline::mapping
