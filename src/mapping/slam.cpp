// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/slam.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <utility>

#include "plumbline/core/numbers.hpp"
#include "plumbline/features/measurement.hpp"
#include "plumbline/mapping/loop_closing/relocalisation_check.hpp"
#include "plumbline/maps/components.hpp"

namespace plumbline::mapping {

using geometry::Rigid3;

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

/// Frames after which background measurements go into the map: a keyframe's work is spread over several
/// frames, and its surfaces are aligned meanwhile.
constexpr std::int64_t kConnectAfter = 2;

/// Frames in a row that are lost before a new component begins: half a second of a common camera.
constexpr int kLostFrames = 15;

/// True if a frame may start a map: it must have depth for landmarks and surfaces. If the camera was covered,
/// all later frames would be lost.
static bool can_start_map(const sensor::RgbdFrame& frame) {
  constexpr double kMinMeasured = 0.05;  // share of the pixels
  return !frame.depth.empty() &&
         cv::countNonZero(frame.depth > 0) > kMinMeasured * static_cast<double>(frame.depth.total());
}

/// Median accuracy of the poses so far, metres: it depends on the measurements that a pipeline uses. Zero:
/// not known.
static double usual_sigma_m(const std::vector<maps::FramePose>& frames) {
  constexpr double kGap = 0.1;  // TrackResult::sigma_m after a gap
  std::vector<double> sigmas;
  for (const maps::FramePose& frame : frames) {
    if (frame.tracked && frame.step_sigma_m > 0.0 && frame.step_sigma_m < kGap)
      sigmas.push_back(frame.step_sigma_m);
  }
  return core::quantile(std::move(sigmas), 0.5, 0.0);
}

/// True if the pose is accurate enough. In a turn that is too fast it is known to centimetres only: such a
/// frame is as good as lost. If only the motion model constrains a direction, no better pose can be had.
/// Where a pipeline uses few of the measurements, centimetres are usual.
static bool is_accurate(const tracking::TrackResult& track, const std::vector<maps::FramePose>& before) {
  constexpr double kEnough_m = 0.01;  // in the weakest direction
  constexpr double kUsual = 10.0;     // times what is usual
  const bool is_first = track.min_eigenvalue == 0.0;
  if (is_first || track.degenerate_directions > 0) return true;
  const double sigma_m = 1.0 / std::sqrt(track.min_eigenvalue);
  if (sigma_m <= kEnough_m) return true;
  const double usual_m = usual_sigma_m(before);
  return usual_m == 0.0 || sigma_m <= kUsual * usual_m;
}

/// True if a frame may begin a component: it must show enough to track the next ones, so not the dark, a hand
/// or a bare wall.
static bool can_begin_component(const sensor::RgbdFrame& frame, const features::FrameFeatures& features) {
  constexpr std::ptrdiff_t kLeastLandmarks = 60;  // points and lines (twice) with depth
  const auto points = std::count_if(features.points.begin(), features.points.end(),
                                    [](const features::PointFeature& f) { return f.depth > 0.0F; });
  const auto lines = std::count_if(features.lines.begin(), features.lines.end(),
                                   [](const features::LineFeature& f) { return f.line3.has_value(); });
  return can_start_map(frame) && points + 2 * lines >= kLeastLandmarks;
}

static ObservationNoise noise_of(const SlamOptions& options) {
  ObservationNoise noise = options.mapper.bundle_noise;
  noise.aligned = options.tracker.association.aligned_sigma;
  noise.orb_scale_factor = options.tracker.association.scale_factor;
  return noise;
}

/// The mapper's corners are as exact when triangulated as in bundles.
static LocalMapperOptions mapper_of(const SlamOptions& options) {
  LocalMapperOptions mapper = options.mapper;
  mapper.triangulation.scale_factor = options.tracker.association.scale_factor;
  mapper.triangulation.aligned = options.tracker.association.aligned_sigma;
  mapper.edges = options.mapper.edges && options.tracker.depth;
  return mapper;
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
      relocalisation_{camera, options.loops.verify, options.loops.seed, options.mapper.surface},
      image_(camera),
      tracker_(options.tracker, camera),
      keyframe_rule_(options.keyframe, camera),
      mapper_(mapper_of(options), camera, robot),
      bundle_({options.mapper.bundle_keyframes, noise_of(options)}, options.mapper.bundle_options,
              options.bundle_lag, camera, executor, log),
      closer_(options.loops, camera),
      joiner_(camera, executor) {
  camera_.color = camera;
  if (!options.loops.enabled) return;

  constexpr std::size_t kLookAlikes = 12;
  tracker_.set_place_finder([this](const features::FrameFeatures& picture) {
    return closer_.look_alikes(map_, picture, kLookAlikes);
  });

  tracker_.set_place_judge([this](const sensor::RgbdFrame& frame, const features::FrameFeatures& features,
                                  core::KeyframeId keyframe, const Rigid3& found_at) {
    const LostAt lost{tracker_.reference(), tracker_.camera_from_world(), tracker_.astray()};
    // After half a second the camera may be where doors and walls repeat: one frame that looks like another
    // place is no evidence there. A component that begins in its place is joined by the evidence of several
    // keyframes.
    const bool stayed = is_near(found_at, lost.camera_from_world, 0.15, 0.15);

    if (options_.components && !stayed && tracker_.lost_frames() >= kLostFrames &&
        can_begin_component(frame, features)) {
      return false;
    }

    return relocalisation_.passes(map_, lost, frame, features, keyframe, found_at);
  });
}

FrameReport Slam::process(const sensor::RgbdFrame& frame, const Features& features, Keyframe keyframe) {
  // Results of work beside the tracker are used at fixed frames, independent of the clock.
  ++frame_count_;
  if (keyframe == Keyframe::kYes) finish();
  BundleReport bundle;
  while (!new_keyframes_.empty() && frame_count_ >= new_keyframes_.front().frame + kConnectAfter)
    connect_keyframe(bundle);
  if (bundle_.due(frame_count_)) put_back_bundle(bundle);

  // Section 3.2: the frame's pose; a lost frame is also searched in the maps of other robots.
  const int lost_before = tracker_.lost_frames();
  last_track_ = tracker_.track(map_, frame, features);
  const bool believed = believes_place(frame, features, lost_before);
  const bool tracked = last_track_.state == tracking::TrackState::kTracked;
  if (!believed || (tracked && !is_accurate(last_track_, frame_poses())))
    last_track_.state = tracking::TrackState::kLost;
  const tracking::TrackResult& track = last_track_;

  if (tracker_.astray()) {
    const auto place = closer_.locate(frame, features, options_.mapper.surface);
    if (place) last_track_ = tracker_.begin_at(*place, frame, features);
  }

  FrameReport report = FrameReport::of(frame, track);
  report.bundle = bundle;
  if (options_.components && tracker_.lost_frames() >= kLostFrames && can_begin_component(frame, *features)) {
    begin_component(frame, features, report);
    return report;
  }

  if (track.state == tracking::TrackState::kInitialising) {
    if (can_start_map(frame)) start_map(frame, features, report);
    report.component = report.keyframe;
    return report;
  }

  // Sections 3.3 and 4.1: what the frame adds to the map.
  maps::FramePose pose = frames_.measured(map_, frame.stamp, track);

  if (pose.tracked) {
    pose.seen = seen_points();
    mapper_.count_observations(map_, track);            // the share of keyframes that find a landmark
    report.decision.wanted = !track.reference.valid();  // where nothing of this map is seen
    if (!report.decision.wanted)
      report.decision = keyframe_rule_.decide(map_, track, new_keyframes_.empty() && bundle_.idle());
    if (keyframe != Keyframe::kByRule) report.decision.wanted = keyframe == Keyframe::kYes;
    if (report.decision.reuse.valid())  // otherwise the map would grow as long as the camera moves
      set_reference(report.reference = report.decision.reuse);
    if (report.decision.wanted) insert_keyframe(frame, features, report);
  }

  // The path.
  frames_.record(map_, pose, tracker_.reference(),
                 pose.tracked ? tracker_.camera_from_world() : track.camera_from_world);
  if (pose.tracked) report.component = maps::root_of(map_, tracker_.reference());
  report.depth_from_camera = track.depth_from_camera;
  return report;
}

/// True if surfaces around the camera confirm its place in several frames in a row, during which no keyframe
/// changes the map.
bool Slam::believes_place(const sensor::RgbdFrame& frame, const Features& features, int lost_before) {
  constexpr int kFrames = 5;
  constexpr int kOutdated = 5;  // lost frames after which the camera may be anywhere
  const tracking::TrackResult& track = last_track_;
  if (!options_.loops.enabled) return true;
  if (!probation_ && track.relocalised && lost_before >= kOutdated) probation_ = Probation{lost_before, 0};
  if (!probation_) return true;

  ++probation_->frames;
  const int lost_frames = probation_->lost_before + probation_->frames;
  bool stands = track.state == tracking::TrackState::kTracked;
  if (stands && probation_->frames < kFrames) return false;

  if (stands) {
    const LostAt lost{tracker_.reference(), tracker_.camera_from_world(), true};
    stands =
        relocalisation_.passes(map_, lost, frame, *features, tracker_.reference(), track.camera_from_world);
  }

  probation_.reset();
  last_track_.relocalised = stands;
  found_again_ = found_again_ || stands;
  if (!stands) tracker_.take_back(lost_frames);
  return stands;
}

void Slam::start_map(const sensor::RgbdFrame& frame, const Features& features, FrameReport& report) {
  report.keyframe = report.reference = mapper_.insert(map_, frame, last_track_, features->levels);
  report.state = tracking::TrackState::kTracked;
  tracker_.add_keyframe(report.keyframe, frame, last_track_);
  set_reference(report.keyframe);
  close_loops(report.keyframe);
  maps::FramePose origin;
  origin.stamp = frame.stamp;
  origin.tracked = true;
  frames_.record(map_, origin, report.keyframe, {});
}

void Slam::begin_component(const sensor::RgbdFrame& frame, const Features& features, FrameReport& report) {
  last_track_ = tracker_.begin_at({}, frame, features);
  const core::KeyframeId id = mapper_.insert(map_, frame, last_track_, features->levels, true);
  new_keyframes_.push_back({id, frame_count_, std::nullopt});
  tracker_.add_keyframe(id, frame, last_track_);
  set_reference(id);
  report.state = tracking::TrackState::kTracked;
  report.keyframe = report.reference = report.component = id;

  maps::FramePose origin;
  origin.stamp = frame.stamp;
  origin.tracked = true;
  frames_.record(map_, origin, id, {});
}

void Slam::insert_keyframe(const sensor::RgbdFrame& frame, const Features& features, FrameReport& report) {
  // Section 3.3: observations and new landmarks, duplicates merged, bad ones culled.
  const core::KeyframeId id = mapper_.insert(map_, frame, last_track_, features->levels);
  NewKeyframe made{id, frame_count_,
                   mapper_.begin_surface_edges(map_, id, frame.depth, last_track_, tracker_.photometric(),
                                               tracker_.local_map().keyframes, executor_)};
  new_keyframes_.push_back(std::move(made));
  tracker_.add_keyframe(id, frame, last_track_);
  mapper_.refine(map_, id);
  if (std::exchange(found_again_, false)) relocalised_.push_back(id);
  set_reference(id);
  report.keyframe = report.reference = id;

  if (options_.bundle_lag < kConnectAfter) connect_keyframe(report.bundle);
}

void Slam::connect_keyframe(BundleReport& report) {
  NewKeyframe made = std::move(new_keyframes_.front());
  new_keyframes_.pop_front();

  // Relative poses with covariance.
  if (made.edges) {
    for (const maps::SurfaceEdge& edge : made.edges->take()) map_.add_edge(edge);
  }

  close_loops(made.id);  // section 4.2
  join_components(made.id);
  if (!options_.mapper.bundle) return;

  // Section 3.3: local bundle adjustment, put back `lag` frames later.
  bundle_.request(map_, made.id, frame_count_);
  if (bundle_.due(frame_count_)) put_back_bundle(report);
}

void Slam::set_reference(core::KeyframeId keyframe) {
  keyframe_rule_.keyframe_made();
  tracker_.map_changed(map_, keyframe, tracker_.camera_from_world());
}

/// Puts the bundle's result into the map. The tracker's pose moves with its reference keyframe; the motion
/// model is a motion between cameras and is not affected.
void Slam::put_back_bundle(BundleReport& report) {
  const std::optional<MapCorrection> correction = bundle_.commit(map_, frame_count_, report);
  if (!correction) return;
  const auto moved = correction->find(tracker_.reference());
  const Rigid3 last = tracker_.camera_from_world();
  tracker_.map_changed(map_, tracker_.reference(),
                       moved == correction->end() ? last : last * moved->second.inverse());
}

void Slam::restore(maps::Map map, std::vector<maps::FramePose> frames) {
  if (map.keyframe_count() == 0) return;
  map_ = std::move(map);
  frames_ = FrameTrajectory(std::move(frames));
  frame_count_ = static_cast<std::int64_t>(frame_poses().size());
  const core::KeyframeId newest = map_.keyframe_ids().back();
  tracker_.restore(map_, newest, frames_.velocity(map_));
  keyframe_rule_.keyframe_made();
  mapper_.restore(map_, newest);
  if (options_.loops.enabled) closer_.restore(map_, newest);
  if (options_.mapper.bundle) bundle_.request(map_, newest, frame_count_);
}

void Slam::commit_bundles() {
  while (!bundle_.idle()) {
    BundleReport ignored;
    put_back_bundle(ignored);
  }
}

void Slam::connect_keyframes() {
  BundleReport ignored;
  while (!new_keyframes_.empty()) connect_keyframe(ignored);
}

/// The whole map may move, so everything that was taken from it before must be back. The tracker waits, so
/// that the next frame is tracked in the new map, independent of the clock.
void Slam::close_loops(core::KeyframeId keyframe) {
  if (!options_.loops.enabled) return;
  const std::size_t disputes = closer_.disputes().size();
  const std::vector<Loop> loops = closer_.detect(map_, keyframe);
  if (closer_.disputes().size() > disputes && give_way()) return;
  if (loops.empty()) return;
  commit_bundles();
  const core::KeyframeId reference = tracker_.reference();
  const Rigid3 camera_from_reference =
      tracker_.camera_from_world() * map_.camera_from_world(reference).inverse();
  std::vector<PoseEdge> edges;
  edges.reserve(loops.size());
  for (const Loop& loop : loops) edges.push_back(LoopCloser::to_edge(loop));
  if (!closer_.close(map_, edges)) return;
  tracker_.map_changed(map_, reference, camera_from_reference * map_.camera_from_world(reference));
}

bool Slam::give_way() {
  if (!options_.components) return false;
  const LoopDispute dispute = closer_.disputes().back();
  const auto lies_between = [&](core::KeyframeId first) {
    return map_.has_keyframe(first) &&
           std::all_of(dispute.loops.begin(), dispute.loops.end(), [&](const Loop& loop) {
             return loop.match < first && !(loop.query < first) &&
                    maps::root_of(map_, loop.match) == maps::root_of(map_, first) &&
                    maps::root_of(map_, loop.query) == maps::root_of(map_, first);
           });
  };

  const auto found = std::find_if(relocalised_.rbegin(), relocalised_.rend(), lies_between);
  if (found == relocalised_.rend()) return false;

  // The loops join the two parts again.
  commit_bundles();
  maps::split_component(map_, *found);

  joiner_.add(map_, dispute.loops);
  relocalised_.erase(std::next(found).base());
  closer_.remove_dispute();
  closer_.clear_pending();
  ++taken_back_;
  tracker_.map_changed(map_, tracker_.reference(), tracker_.camera_from_world());
  return true;
}

/// Moves the component that began later into the frame of the other one. Nothing is changed if the pose graph
/// rejects what joins them.
void Slam::join_components(core::KeyframeId keyframe) {
  if (!options_.loops.enabled || !options_.components) return;
  auto overlap = joiner_.look_up(map_, keyframe, closer_.database());
  if (!overlap) return;
  commit_bundles();

  // The components are aligned, connected by the pair of keyframes that share most, and adjusted together.
  maps::Map map = map_;
  const std::size_t joining = maps::component(map, overlap->b).keyframe_count();
  maps::move_component(map, overlap->b, overlap->evidence.alignment.a_from_b);

  std::vector<PoseEdge> edges;
  const VerifiedPair* best = nullptr;
  const auto share = [](const VerifiedPair& pair) { return pair.evidence.points + 2 * pair.evidence.lines; };
  for (const VerifiedPair& pair : overlap->evidence.pairs) {
    edges.push_back(
        {pair.match, pair.query, pair.evidence.query_from_match, pair.evidence.information, false});
    if (best == nullptr || share(pair) > share(*best)) best = &pair;
  }

  const bool query_in_a = maps::root_of(map, best->query) == overlap->a;
  map.set_parent(overlap->b, query_in_a ? best->query : best->match);
  if (!closer_.close(map, edges)) return;

  // The tracker continues at the same pose relative to its keyframe.
  const core::KeyframeId reference = tracker_.reference();
  const Rigid3 camera_from_reference =
      tracker_.camera_from_world() * map_.camera_from_world(reference).inverse();
  map_ = std::move(map);
  tracker_.map_changed(map_, reference, camera_from_reference * map_.camera_from_world(reference));
  joiner_.joined(overlap->a, overlap->b);
  joins_.push_back({std::move(*overlap), map_.keyframe(keyframe).stamp, joining});
}

void Slam::finish() {
  connect_keyframes();
  commit_bundles();
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
  connect_keyframes();
  commit_bundles();

  std::vector<maps::FramePose> frames = frames_.poses();
  const geometry::Trajectory path_before = maps::trajectory(frames, map_);
  recalibrate_map(change, map_, frames);
  const SurfaceMeasurement how{options_.mapper.surface, options_.mapper.edge_min_overlap,
                               options_.mapper.edge_photometric};
  if (read) measure_surfaces_again(image_, frames, read, how, executor_, map_);

  GlobalAdjustmentOptions adjustment;
  adjustment.noise.orb_scale_factor = options_.tracker.association.scale_factor;
  adjust_recalibrated_map(image_, options_.mapper.fusion, adjustment, map_);
  solve_frames_again(change.after(), map_, frames_.poses(), path_before, executor_, frames);

  frames_ = FrameTrajectory(std::move(frames));
  tracker_.recalibrate(change);
  closer_.clear_pending();
  const maps::FramePose& last = frames_.poses().back();
  tracker_.map_changed(map_, tracker_.reference(),
                       last.camera_from_reference * map_.camera_from_world(last.reference));
}

/// Landmarks that the last frame was matched with, spread over all of them, including some that do not fit.
std::shared_ptr<const maps::SeenPoints> Slam::seen_points() const {
  constexpr std::size_t kMost = 150;
  const tracking::TrackResult& track = last_track_;
  if (track.features == nullptr || track.points.empty()) return nullptr;

  // All of the first 2000 frames are kept, every second of the next 2000, every fourth of the next 4000, and
  // so on: a long run keeps little more than a short one.
  std::size_t every = 1;
  while (frame_poses().size() >= 2000 * every) every *= 2;
  if (frame_poses().size() % every != 0) return nullptr;

  const sensor::ImageModel model(image_, camera_);
  const ObservationNoise noise = noise_of(options_);
  auto seen = std::make_shared<maps::SeenPoints>();
  seen->depth_delay_s = camera_.depth_delay_s;

  const auto keep = [&](const tracking::PointMatch& m, const Eigen::Vector2f& shift) {
    const features::PointFeature& f = track.features->points[static_cast<std::size_t>(m.feature)];
    const Eigen::Vector2f pixel = f.pixel + shift;
    const float depth = track.features->depth_beside(static_cast<std::size_t>(m.feature), shift);
    const auto measured = features::measurement_of({pixel.cast<double>(), static_cast<double>(depth)},
                                                   track.features->shutter_motion, model);
    seen->points.push_back({m.point, measured.pixel.cast<float>(), static_cast<float>(measured.depth),
                            static_cast<float>(noise.of(f, m.aligned).pixel_sigma)});
  };

  const std::size_t all = track.points.size() + track.doubtful.size();
  const std::size_t count = std::min(kMost, all);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t n = i * all / count;
    if (n < track.points.size()) {
      keep(track.points[n], Eigen::Vector2f::Zero());  // it is at its aligned position already
    } else {
      keep(track.doubtful[n - track.points.size()], track.doubtful[n - track.points.size()].shift);
    }
  }

  return seen;
}

geometry::Trajectory Slam::trajectory() const { return maps::trajectory(frame_poses(), map_); }

}  // namespace plumbline::mapping
