// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/slam.hpp"

#include <algorithm>
#include <opencv2/core.hpp>
#include <optional>
#include <utility>

#include "plumbline/tracking/surface_sampler.hpp"

namespace plumbline::mapping {

using geometry::Rigid3;

void SlamOptions::declare(core::OptionTable& table) {
  tracker.declare(table);
  keyframe.declare(table);
  mapper.declare(table);
  table.integer("bundle.lag", bundle_lag, {0, 1000}, "",
                "Frames after which an adjusted bundle is put back into the map; the tracker goes on "
                "meanwhile. 0: it waits on the spot");
  loops.declare(table);
}

/// A map's first frame must have depth to make landmarks and surfaces of: on a covered camera's nothing, all
/// that follows would be lost.
static bool can_start_map(const sensor::RgbdFrame& frame) {
  constexpr double kMinMeasured = 0.05;  // share of the pixels
  return !frame.depth.empty() &&
         cv::countNonZero(frame.depth > 0) > kMinMeasured * static_cast<double>(frame.depth.total());
}

static int points_with_depth(const features::FrameFeatures& features) {
  return static_cast<int>(std::count_if(features.points.begin(), features.points.end(),
                                        [](const features::PointFeature& f) { return f.depth > 0.0F; }));
}

static ObservationNoise noise_of(const SlamOptions& options) {
  ObservationNoise noise = options.mapper.bundle_noise;
  noise.orb_scale_factor = options.tracker.association.scale_factor;
  return noise;
}

/// The mapper's corners are as exact when triangulated as in bundles.
static LocalMapperOptions mapper_of(const SlamOptions& options) {
  LocalMapperOptions mapper = options.mapper;
  mapper.triangulation.scale_factor = options.tracker.association.scale_factor;
  mapper.triangulation.aligned = options.mapper.bundle_noise.aligned;
  return mapper;
}

Slam::Slam(const SlamOptions& options, const sensor::Pinhole& camera, std::int32_t robot,
           const core::Executor& executor, core::Log& log)
    : options_(options),
      camera_(camera),
      robot_(robot),
      log_(&log),
      tracker_(options.tracker, camera),
      rule_(options.keyframe),
      mapper_(mapper_of(options), camera),
      bundle_({options.mapper.bundle_keyframes, noise_of(options)}, options.mapper.bundle_options,
              options.bundle_lag, camera, executor),
      closer_(options.loops, camera) {
  if (!options.loops.enabled) return;
  constexpr std::size_t kLookAlikes = 12;
  tracker_.set_place_finder([this](const features::FrameFeatures& picture) {
    return closer_.look_alikes(map_, picture, kLookAlikes);
  });
  tracker_.set_place_judge([this](const sensor::RgbdFrame& frame, const features::FrameFeatures& features,
                                  core::KeyframeId keyframe, const Rigid3& camera_from_world) {
    return is_place(frame, features, keyframe, camera_from_world);
  });
}

Slam::~Slam() = default;

void Slam::set_shutter(std::optional<double> readout_s) {
  if (options_.tracker.readout_s > 0.0 || !readout_s) return;
  tracker_.set_readout(*readout_s);
  all_rows_at_once_ = *readout_s == 0.0;
}

/// Keyframes know how fast the camera turned because that shears their pictures; not with all rows at once.
double Slam::distorting_turn_rate() const { return all_rows_at_once_ ? 0.0 : tracker_.turn_rate(); }

/// A camera that turns up far from where it was lost must pass as a loop would: corridors look alike from
/// both ends. Near by there is nothing to confuse.
bool Slam::is_place(const sensor::RgbdFrame& frame, const features::FrameFeatures& features,
                    core::KeyframeId keyframe, const Rigid3& camera_from_world) const {
  constexpr double kNear_m = 0.6;
  constexpr double kNear_rad = 0.6;
  constexpr double kSame_m = 0.1;
  constexpr double kSame_rad = 0.05;
  const auto apart = [](const Rigid3& a, const Rigid3& b) {
    return (a.inverse().translation - b.inverse().translation).norm();
  };
  const auto turned = [](const Rigid3& a, const Rigid3& b) {
    return geometry::rotation_angle(a.rotation * b.rotation.transpose());
  };
  if (apart(camera_from_world, last_camera_from_world_) < kNear_m &&
      turned(camera_from_world, last_camera_from_world_) < kNear_rad) {
    return true;
  }
  if (features.points.empty() && features.lines.empty()) return true;  // depth alone: nothing to match
  auto seen = std::make_shared<maps::Keyframe>();
  seen->id = {robot_, 0};
  seen->stamp = frame.stamp;
  seen->features = std::make_shared<features::FrameFeatures>(features);
  seen->surface = tracking::sample_surface(frame.depth, camera_, options_.mapper.surface);
  maps::Map probe;
  probe.add_keyframe(seen, camera_from_world);
  const PlaceVerification found = verify_place({&probe, seen->id, camera_}, {&map_, keyframe, camera_},
                                               options_.loops.verify, options_.loops.seed);
  if (!found.accepted) return false;
  const Rigid3 verified = found.query_from_match * map_.camera_from_world(keyframe);
  return apart(camera_from_world, verified) < kSame_m && turned(camera_from_world, verified) < kSame_rad;
}

void Slam::start_map(const sensor::RgbdFrame& frame,
                     const std::shared_ptr<const features::FrameFeatures>& features, FrameReport& report) {
  tracking::TrackResult origin;
  report.keyframe = mapper_.insert(map_, robot_, frame, features, origin, {}, {}, 0.0);
  record_image(frame, report.keyframe);
  report.reference = report.keyframe;
  report.state = tracking::TrackState::kTracked;
  rule_.keyframe_made();
  last_camera_from_world_ = origin.camera_from_world;
  tracker_.map_changed(map_, report.keyframe, origin.camera_from_world);
  if (options_.loops.enabled) close_loops(report.keyframe);
}

/// What the tracker knows moves with its reference keyframe. The motion model is a motion between cameras:
/// the world's place does not matter to it.
void Slam::put_back_bundle(BundleReport& report) {
  const std::optional<MapCorrection> correction = bundle_.commit(map_, clock_, report);
  if (report.refused) {
    ++refused_bundles_;
    log_->warning("a local bundle was not put into the map: " + report.refused->text());
  }
  if (!correction) return;
  const auto moved = correction->find(tracker_.reference());
  if (moved != correction->end()) last_camera_from_world_ = last_camera_from_world_ * moved->second.inverse();
  tracker_.map_changed(map_, tracker_.reference(), last_camera_from_world_);
}

/// The motion between the last two frames, per second, as the tracker had it.
static geometry::Vector6d last_motion(const std::vector<maps::FramePose>& frames, const maps::Map& map) {
  if (frames.size() < 2) return geometry::Vector6d::Zero();
  const maps::FramePose& now = frames[frames.size() - 1];
  const maps::FramePose& before = frames[frames.size() - 2];
  constexpr double kLongest_s = 0.5;
  const double dt = now.stamp - before.stamp;
  if (!now.tracked || !before.tracked || !(dt > 1e-4 && dt < kLongest_s)) return geometry::Vector6d::Zero();
  const Rigid3 now_from_world = now.camera_from_reference * map.camera_from_world(now.reference);
  const Rigid3 before_from_world = before.camera_from_reference * map.camera_from_world(before.reference);
  return geometry::log_se3(now_from_world * before_from_world.inverse()) / dt;
}

/// How the camera moved from the colour to the depth image, with the motion that was found for this frame.
static Rigid3 motion_to_depth(const sensor::RgbdFrame& frame, const std::vector<maps::FramePose>& frames,
                              const maps::Map& map) {
  constexpr double kMost_s = 0.05;
  const double dt = frame.depth_stamp - frame.stamp;
  if (dt == 0.0 || std::abs(dt) > kMost_s) return {};
  return geometry::exp_se3(last_motion(frames, map) * dt);
}

FrameReport Slam::process(const sensor::RgbdFrame& frame,
                          std::shared_ptr<const features::FrameFeatures> features) {
  FrameReport report;
  report.frame_index = frame.index;
  report.stamp = frame.stamp;
  ++clock_;
  if (bundle_.due(clock_)) put_back_bundle(report.bundle);
  const std::shared_ptr<const features::FrameFeatures> taken = features;
  last_track_ = tracker_.track(map_, frame, features);
  if (last_track_.features != nullptr) features = last_track_.features;
  const tracking::TrackResult& track = last_track_;
  report.state = track.state;
  if (track.state == tracking::TrackState::kInitialising) {
    if (!can_start_map(frame)) return report;
    start_map(frame, features, report);
    record_pose(frame.stamp, Rigid3{}, true);
    return report;
  }
  report.reference = tracker_.reference();
  report.points = track.estimate.points;
  report.lines = track.estimate.lines;
  report.surface = track.estimate.planes;
  report.photometric = track.estimate.photometric;
  report.min_eigenvalue = track.min_eigenvalue;
  report.weak_directions = track.weak_directions;
  report.relocalised = track.relocalised;
  if (track.state != tracking::TrackState::kTracked) {
    record_pose(frame.stamp, track.camera_from_world, false);
    return report;
  }
  last_camera_from_world_ = track.camera_from_world;
  const auto step = motion_since_last(track.camera_from_world);  // in the map that it was tracked in
  mapper_.count_observations(map_, track);
  report.decision =
      rule_.decide(map_, tracker_.reference(), track, camera_,
                   {static_cast<int>(features->points.size()), bundle_.idle(), points_with_depth(*features)});
  if (report.decision.wanted && !report.decision.urgent) switch_reference(report);
  if (report.decision.wanted) make_keyframe(frame, features, taken->levels, report);
  record_pose(frame.stamp, last_camera_from_world_, true);
  frames_.back().camera_from_previous = step;
  frames_.back().step_sigma_m = track.sigma_m();
  if (options_.tracker.align_stamps) report.depth_from_camera = motion_to_depth(frame, frames_, map_);
  return report;
}

void Slam::switch_reference(FrameReport& report) {
  const core::KeyframeId known = rule_.earlier_reference(map_, tracker_.reference(), last_track_, camera_);
  if (!known.valid()) return;
  report.decision.wanted = false;
  report.reference = known;
  rule_.keyframe_made();
  tracker_.map_changed(map_, known, last_camera_from_world_);
}

void Slam::make_keyframe(const sensor::RgbdFrame& frame,
                         const std::shared_ptr<const features::FrameFeatures>& features,
                         const std::vector<cv::Mat>& levels, FrameReport& report) {
  report.keyframe = mapper_.insert(map_, robot_, frame, features, last_track_, levels, tracker_.reference(),
                                   distorting_turn_rate());
  report.reference = report.keyframe;
  if (options_.mapper.edges && options_.tracker.depth) {
    mapper_.add_surface_edges(map_, report.keyframe, frame.depth, last_track_, tracker_.photometric(),
                              tracker_.local_map().keyframes);
  }
  record_image(frame, report.keyframe);
  mapper_.refine(map_, report.keyframe);
  rule_.keyframe_made();
  tracker_.map_changed(map_, report.keyframe, last_camera_from_world_);
  if (options_.loops.enabled) close_loops(report.keyframe);
  if (!options_.mapper.bundle) return;
  bundle_.request(map_, report.keyframe, clock_);
  if (bundle_.due(clock_)) put_back_bundle(report.bundle);  // without a lag
}

void Slam::record_image(const sensor::RgbdFrame& frame, core::KeyframeId keyframe) {
  if (!options_.tracker.photometric || last_track_.photometric == nullptr) return;
  tracker_.add_photometric(
      keyframe,
      std::make_shared<const features::PhotometricSamples>(features::sample_photometric(
          *last_track_.photometric, frame.depth, camera_, last_track_.depth_from_camera.inverse())));
}

void Slam::restore(maps::Map map, std::vector<maps::FramePose> frames) {
  if (map.keyframe_count() == 0) return;
  map_ = std::move(map);
  frames_ = std::move(frames);
  clock_ = static_cast<std::int64_t>(frames_.size());
  const core::KeyframeId newest = map_.keyframe_ids().back();
  last_camera_from_world_ = map_.camera_from_world(newest);
  tracker_.restore(map_, newest, last_camera_from_world_, last_motion(frames_, map_));
  rule_.keyframe_made();
  mapper_.restore(map_, newest);
  if (options_.loops.enabled) closer_.restore(map_, newest);
  if (options_.mapper.bundle) bundle_.request(map_, newest, clock_);
}

/// The frame before lies where its keyframe does now.
std::optional<Rigid3> Slam::motion_since_last(const Rigid3& camera_from_world) const {
  if (frames_.empty() || !frames_.back().tracked) return std::nullopt;
  const maps::FramePose& last = frames_.back();
  return camera_from_world * (last.camera_from_reference * map_.camera_from_world(last.reference)).inverse();
}

void Slam::record_pose(double stamp, const Rigid3& camera_from_world, bool tracked) {
  const core::KeyframeId reference = tracker_.reference();
  maps::FramePose pose;
  pose.stamp = stamp;
  pose.reference = reference;
  pose.camera_from_reference = camera_from_world * map_.camera_from_world(reference).inverse();
  pose.tracked = tracked;
  frames_.push_back(pose);
}

void Slam::commit_bundles() {
  while (!bundle_.idle()) {
    BundleReport ignored;
    put_back_bundle(ignored);
  }
}

/// The whole map may move: what was taken from it before must be back. The tracker waits, so that the next
/// frame is tracked against the map as it is then, whatever the clock says.
void Slam::close_loops(core::KeyframeId keyframe) {
  const std::vector<Loop> loops = closer_.detect(map_, keyframe);
  if (loops.empty()) return;
  commit_bundles();
  const Rigid3 camera_from_keyframe = last_camera_from_world_ * map_.camera_from_world(keyframe).inverse();
  std::vector<PoseEdge> edges;
  for (const Loop& loop : loops) edges.push_back(LoopCloser::to_edge(loop));
  if (!closer_.close(map_, edges)) return;
  last_camera_from_world_ = camera_from_keyframe * map_.camera_from_world(keyframe);
  tracker_.map_changed(map_, keyframe, last_camera_from_world_);
}

void Slam::finish() { commit_bundles(); }

geometry::Trajectory Slam::trajectory() const { return maps::trajectory(frames_, map_); }

geometry::Trajectory Slam::keyframe_trajectory() const { return maps::keyframe_trajectory(map_); }

std::vector<maps::LineSegment3> Slam::line_segments() const { return maps::line_segments(map_); }

}  // namespace plumbline::mapping
