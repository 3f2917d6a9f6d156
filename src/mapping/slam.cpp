// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/slam.hpp"

#include <utility>

#include "plumbline/mapping/adjustment/map_recalibration.hpp"
#include "plumbline/maps/components.hpp"

namespace plumbline::mapping {

void SlamOptions::declare(core::OptionTable& table) {
  tracker.declare(table);
  keyframe.declare(table);
  mapper.declare(table);
  table.integer("bundle.lag", bundle_lag, {0, 1000}, "",
                "Number of frames after which an adjusted bundle is put back into the map, while the tracker "
                "continues; 0: the tracker waits");
  loops.declare(table);
  table.boolean(
      "components", components,
      "When the camera stays lost, go on in a second map and join the two where they show the same place");
}

ObservationNoise SlamOptions::noise() const {
  ObservationNoise noise = mapper.bundle_noise;
  noise.aligned = tracker.association.aligned_sigma;
  noise.orb_scale_factor = tracker.association.scale_factor;
  return noise;
}

FrameReport FrameReport::of(const sensor::RgbdFrame& frame, const tracking::TrackResult& track) {
  FrameReport report;
  report.frame_index = frame.index;
  report.stamp = frame.stamp;
  report.state = track.state;
  report.reference = track.reference;
  report.points = track.estimate.points;
  report.lines = track.estimate.lines;
  report.surface = track.estimate.planes;
  report.photometric = track.estimate.photometric;
  report.min_eigenvalue = track.min_eigenvalue;
  report.degenerate_directions = track.degenerate_directions;
  report.relocalised = track.relocalised;
  return report;
}

Slam::Slam(const SlamOptions& options, const sensor::Pinhole& camera, std::int32_t robot,
           const core::Executor& executor, core::Log& log)
    : options_(options),
      executor_(executor),
      image_(camera),
      tracker_(options.tracker, camera),
      keyframe_rule_(options.keyframe, camera),
      mapper_(options.mapper, options.tracker, camera, robot),
      connector_(options_, camera, executor, log),
      relocalisation_(options_, camera, connector_.loops()) {
  camera_.color = camera;
}

FrameReport Slam::process(const sensor::RgbdFrame& frame, const Features& features, Keyframe keyframe) {
  MapPosition camera = position();
  const BundleReport bundle = connector_.begin_frame(map_, camera, keyframe == Keyframe::kYes);
  follow(camera);

  // Section 3.2: the frame's pose, which must be accurate.
  const int lost_before = tracker_.lost().frames;
  tracking::TrackResult track = tracker_.track(map_, mapper_.around(), frame, features,
                                               options_.loops.enabled ? &relocalisation_ : nullptr);
  const auto never_found = relocalisation_.judge(map_, frame, *features, lost_before, track);
  if (never_found) tracker_.take_back(*never_found);
  if (track.state == tracking::TrackState::kTracked && !frames_.is_accurate(track))
    track.state = tracking::TrackState::kLost;

  // A lost frame is also searched in the maps of other robots.
  if (tracker_.lost().astray) {
    const auto place = connector_.loops().locate(frame, features, options_.mapper.surface);
    if (place) track = tracker_.begin_at(*place, frame, features);
  }

  FrameReport report = FrameReport::of(frame, track);
  report.bundle = bundle;
  extend_map(frame, features, keyframe, track, report);
  report.track = std::make_shared<const tracking::TrackResult>(std::move(track));
  return report;
}

void Slam::extend_map(const sensor::RgbdFrame& frame, const Features& features, Keyframe keyframe,
                      tracking::TrackResult& track, FrameReport& report) {
  // A frame in which a map or a component begins.
  if (options_.components && tracker_.lost().frames >= kLostFrames && can_begin_component(frame, *features)) {
    track = tracker_.begin_at({}, frame, features);
    begin(frame, features, track, report);
    return;
  }

  if (track.state == tracking::TrackState::kInitialising) {
    if (can_begin_map(frame)) begin(frame, features, track, report);
    return;
  }

  // Sections 3.3 and 4.1: what the frame adds to the map.
  maps::FramePose pose = frames_.measured(map_, frame.stamp, track);
  if (pose.tracked) {
    pose.seen = frames_.seen_points(track, {image_, camera_}, options_.noise());
    mapper_.count_observations(map_, track);            // the share of keyframes that find a landmark
    report.decision.wanted = !track.reference.valid();  // where nothing of this map is seen
    if (!report.decision.wanted) report.decision = keyframe_rule_.decide(map_, track, connector_.idle());
    if (keyframe != Keyframe::kByRule) report.decision.wanted = keyframe == Keyframe::kYes;
    if (report.decision.reuse.valid())  // otherwise the map would grow as long as the camera moves
      set_reference(report.reference = report.decision.reuse);
    if (report.decision.wanted) insert_keyframe(frame, features, track, report);
  }

  // The path.
  const MapPosition camera = position();
  frames_.record(map_, pose, camera.reference,
                 pose.tracked ? camera.camera_from_world : track.camera_from_world);
  if (pose.tracked) report.component = maps::root_of(map_, camera.reference);
  report.depth_from_camera = track.depth_from_camera;
}

/// The frame becomes the first keyframe of the map, or of a component.
void Slam::begin(const sensor::RgbdFrame& frame, const Features& features, const tracking::TrackResult& track,
                 FrameReport& report) {
  const bool is_first = map_.keyframe_count() == 0;
  const core::KeyframeId id = mapper_.insert(map_, frame, track, features->levels, true);
  mapper_.keep_intensities(id, frame.depth, track);
  set_reference(id);
  if (is_first) {
    connector_.add_first(map_, id);
  } else {
    connector_.add(id, std::nullopt);
  }

  report.state = tracking::TrackState::kTracked;
  report.keyframe = report.reference = report.component = id;
  maps::FramePose origin;
  origin.stamp = frame.stamp;
  origin.tracked = true;
  frames_.record(map_, origin, id, {});
}

void Slam::insert_keyframe(const sensor::RgbdFrame& frame, const Features& features,
                           const tracking::TrackResult& track, FrameReport& report) {
  // Section 3.3: observations and new landmarks, duplicates merged, bad ones culled.
  const core::KeyframeId id = mapper_.insert(map_, frame, track, features->levels);
  connector_.add(id, mapper_.begin_surface_edges(map_, id, frame.depth, track, executor_));
  mapper_.keep_intensities(id, frame.depth, track);
  mapper_.refine(map_, id);
  if (relocalisation_.take_found_again()) connector_.components().found_again(id);
  set_reference(id);
  report.keyframe = report.reference = id;

  MapPosition camera = position();
  connector_.connect_at_once(map_, camera, report.bundle);
  follow(camera);
}

/// Tracker and local map follow the map, if it has changed.
void Slam::follow(const MapPosition& camera) {
  if (!camera.map_changed) return;
  mapper_.look_around(map_, camera.reference);
  tracker_.set_camera_from_world(camera.camera_from_world);
}

void Slam::finish() {
  MapPosition camera = position();
  connector_.finish(map_, camera);
  follow(camera);
}

void Slam::restore(maps::Map map, std::vector<maps::FramePose> frames) {
  if (map.keyframe_count() == 0) return;
  map_ = std::move(map);
  frames_ = FrameTrajectory(std::move(frames));
  const core::KeyframeId newest = map_.keyframe_ids().back();
  tracker_.restore(map_.keyframe(newest), map_.camera_from_world(newest), frames_.velocity(map_));
  keyframe_rule_.keyframe_made();
  mapper_.restore(map_, newest);
  connector_.restore(map_, newest, static_cast<std::int64_t>(frame_poses().size()));
}

void Slam::set_camera(const sensor::Camera& camera) {
  camera_ = camera;
  if (options_.tracker.readout_s > 0.0) camera_.readout_s = options_.tracker.readout_s;
  tracker_.set_shutter(camera_.readout_s);
}

void Slam::recalibrate(const sensor::Camera& camera, const PictureReader& read) {
  const sensor::Camera before = camera_;
  set_camera(camera);
  if (map_.keyframe_count() == 0) return;
  const sensor::Recalibration change(image_, before, camera_);

  // Background work that began with the old camera must be in the map before the map is converted.
  finish();

  std::vector<maps::FramePose> frames = frames_.poses();
  const geometry::Trajectory path_before = maps::trajectory(frames, map_);
  recalibrate_map(change, map_, frames);
  const SurfaceMeasurement how{options_.mapper.surface, options_.mapper.edge_min_overlap,
                               options_.mapper.edge_photometric};
  if (read) measure_surfaces_again(image_, frames, read, how, executor_, map_);

  // The map is adjusted before the frames between keyframes, whose poses follow from its landmarks.
  GlobalAdjustmentOptions adjustment;
  adjustment.noise.orb_scale_factor = options_.tracker.association.scale_factor;
  adjust_recalibrated_map(image_, options_.mapper.fusion, adjustment, map_);
  solve_frames_again(change.after(), map_, frames_.poses(), path_before, executor_, frames);

  // All else that holds measurements of the old camera is converted or dropped.
  frames_ = FrameTrajectory(std::move(frames));
  mapper_.recalibrate(change);
  connector_.loops().clear_pending();
  const maps::FramePose& last = frames_.poses().back();
  follow({mapper_.reference(), last.camera_from_reference * map_.camera_from_world(last.reference), true});
}

}  // namespace plumbline::mapping
