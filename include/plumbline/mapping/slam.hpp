// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// One robot's SLAM: frames in, poses and a map out. The loop of sections 3 and 4 of Xia, Wu, Ma, Zhu, Cheng,
// Zhu, "Multi-Robot Collaborative Mapping with Integrated Point-Line Features for Visual SLAM", Sensors 2024,
// 24(17), 5743. Bundles are adjusted beside the tracker; what comes out is the same for any number of
// threads.
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "plumbline/core/executor.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/features/frame_features.hpp"
#include "plumbline/mapping/adjustment/map_recalibration.hpp"
#include "plumbline/mapping/frame_trajectory.hpp"
#include "plumbline/mapping/loop_closing/relocalisation.hpp"
#include "plumbline/mapping/map_connector.hpp"
#include "plumbline/mapping/slam_options.hpp"
#include "plumbline/maps/map.hpp"
#include "plumbline/tracking/tracker.hpp"

namespace plumbline::mapping {

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
  std::shared_ptr<const tracking::TrackResult> track;  ///< for drawing it
  static FrameReport of(const sensor::RgbdFrame& frame, const tracking::TrackResult& track);
};

class Slam {
 public:
  Slam(const SlamOptions& options, const sensor::Pinhole& camera, std::int32_t robot,
       const core::Executor& executor, core::Log& log);

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
    if (options_.loops.enabled) connector_.loops().use(std::move(others));
  }

  /// Sensors of the body that carries the camera (tracking::Tracker::set_motion_sensor).
  void use(tracking::MotionSensor sensor) { tracker_.set_motion_sensor(std::move(sensor)); }

  using Features = std::shared_ptr<const features::FrameFeatures>;
  enum class Keyframe { kByRule, kYes, kNo };  ///< whether a frame becomes a keyframe
  /// Frames in order of time. The features are kept when the frame becomes a keyframe. The report's state may
  /// be lost although the tracker found a pose: at a place that is not confirmed yet, or one that is not
  /// accurate.
  FrameReport process(const sensor::RgbdFrame& frame, const Features& features,
                      Keyframe keyframe = Keyframe::kByRule);
  /// Ends the background work; call once, after the last frame.
  void finish();

  /// All components (maps/components.hpp).
  [[nodiscard]] const maps::Map& map() const { return map_; }
  /// Results of loops, components and bundles.
  [[nodiscard]] const MapConnector& connections() const { return connector_; }
  /// Every frame in order, relative to its keyframe.
  [[nodiscard]] const std::vector<maps::FramePose>& frame_poses() const { return frames_.poses(); }
  /// Replaces them, of the same recording, for a map that was made of some of its frames only.
  void set_frames(std::vector<maps::FramePose> frames) { frames_ = FrameTrajectory(std::move(frames)); }

 private:
  void extend_map(const sensor::RgbdFrame& frame, const Features& features, Keyframe keyframe,
                  tracking::TrackResult& track, FrameReport& report);
  void begin(const sensor::RgbdFrame& frame, const Features& features, const tracking::TrackResult& track,
             FrameReport& report);
  void insert_keyframe(const sensor::RgbdFrame& frame, const Features& features,
                       const tracking::TrackResult& track, FrameReport& report);
  void set_reference(core::KeyframeId keyframe) {
    keyframe_rule_.keyframe_made();
    mapper_.look_around(map_, keyframe);
  }
  [[nodiscard]] MapPosition position() const {
    return {mapper_.reference(), tracker_.lost().camera_from_world};
  }
  void follow(const MapPosition& camera);

  SlamOptions options_;
  const core::Executor& executor_;
  sensor::Pinhole image_;
  sensor::Camera camera_;
  maps::Map map_;
  tracking::Tracker tracker_;
  KeyframeRule keyframe_rule_;
  LocalMapper mapper_;
  MapConnector connector_;
  Relocalisation relocalisation_;
  FrameTrajectory frames_;
};

}  // namespace plumbline::mapping
