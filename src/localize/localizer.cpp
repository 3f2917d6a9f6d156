// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/localize/localizer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <utility>

#include "plumbline/features/rolling_shutter.hpp"
#include "plumbline/mapping/loop_closing/relocalisation.hpp"

namespace plumbline::localize {

using core::KeyframeId;
using geometry::Rigid3;

namespace {

constexpr int kForgotten = 30;         // lost frames after which the last pose is of no use
constexpr int kStillThere = 5;         // lost frames after which a place near by needs no confirmation
constexpr double kStillThere_m = 0.3;  // and what is near by
constexpr double kStillThere_rad = 0.3;
constexpr std::size_t kMostWaiting = 30;  // frames that wait for a confirmation
constexpr int kMany = 50;                 // landmarks: half the share is enough
constexpr int kFewInView = 40;            // landmarks: what is bare is told by its surfaces
constexpr double kInaccurate_m = 0.01;    // in the weakest direction

// Errors that neighbouring features and samples have in common do not average out, nor do those of the
// map's camera and depth: the further the camera is from the views that were mapped, the more of that shows.
constexpr double kFloor_m = 0.004;
constexpr double kFloor_rad = 0.002;
constexpr double kPerDistance = 0.025;
constexpr double kUsualDepth_m = 2.0;

constexpr std::size_t kSmoothed = 4;  // steps whose mean motion undoes the rolling shutter

int landmarks(std::size_t points, std::size_t lines) { return static_cast<int>(points + 2 * lines); }

double share_found(const tracking::TrackResult& track) {
  const int visible = landmarks(track.visible_points.size(), track.visible_lines.size());
  return visible > 0 ? static_cast<double>(landmarks(track.points.size(), track.lines.size())) / visible
                     : 0.0;
}

/// Mean depth of the landmarks that agree, metres.
double depth_of(const tracking::TrackResult& track) {
  double sum = 0.0;
  int count = 0;
  for (const tracking::PointMatch& match : track.points) {
    const float depth = track.features->points[static_cast<std::size_t>(match.feature)].depth;
    if (!(depth > 0.0F)) continue;
    sum += static_cast<double>(depth);
    ++count;
  }
  return count > 0 ? sum / count : kUsualDepth_m;
}

/// The distance of two views, metres; a turn counts as what it moves at this depth.
double distance(const Rigid3& a_from_world, const Rigid3& b_from_world, double depth_m) {
  const Rigid3 step = a_from_world * b_from_world.inverse();
  return step.translation.norm() + depth_m * geometry::rotation_angle(step.rotation);
}

/// The keyframe from which the view is the nearest, `clearly` times nearer than from `present`; or that.
KeyframeId nearest(const maps::Map& map, const Rigid3& camera_from_world, KeyframeId present,
                   double clearly) {
  KeyframeId best = present;
  double least = distance(camera_from_world, map.camera_from_world(present), kUsualDepth_m) / clearly;
  for (const KeyframeId id : map.keyframe_ids()) {
    const double d = distance(camera_from_world, map.camera_from_world(id), kUsualDepth_m);
    if (d >= least) continue;
    best = id;
    least = d;
  }
  return best;
}

/// Focal lengths by robot; and without patches of other focal lengths, which are aligned as if of this one.
tracking::TrackerOptions tracker_for(tracking::TrackerOptions options,
                                     const std::vector<maps::RobotInfo>& robots,
                                     const sensor::Pinhole& camera) {
  constexpr double kSameFocal = 0.01;
  for (const maps::RobotInfo& robot : robots) {
    auto& focals = options.association.focals_px;
    focals.resize(std::max(focals.size(), static_cast<std::size_t>(robot.number) + 1), camera.fx);
    const double theirs = robot.camera.color.fx;
    focals[static_cast<std::size_t>(robot.number)] = theirs;
    if (std::abs(theirs / camera.fx - 1.0) > kSameFocal) options.association.align = false;
  }
  return options;
}

}  // namespace

void LocalizerOptions::declare(core::OptionTable& table) {
  tracker.declare(table);
  places.declare(table);
  table.integer("confirm", confirm, {1, 100}, "",
                "Number of frames in a row that must be tracked before a place is believed");
  table.integer("min_features", min_features, {4, 1000}, "",
                "Smallest number of landmarks that agree with a pose; lines count twice");
  table.number("min_found", min_found, {0.0, 1.0}, "",
               "Smallest share of the landmarks in view that agree with a pose");
}

Localizer::Localizer(const LocalizationMap& map, const sensor::Camera& camera,
                     const LocalizerOptions& options)
    : map_(map),
      options_(options),
      camera_(camera.color),
      readout_s_(camera.readout_s.value_or(options.tracker.readout_s)),
      places_(map, options.places, camera.color),
      tracker_(tracker_for(options.tracker, map.robots, camera.color), camera.color) {
  // Frames come with the rolling shutter undone
  tracker_.set_shutter(0.0);
}

Localizer::~Localizer() = default;

std::vector<LocatedFrame> Localizer::process(std::size_t number, const sensor::RgbdFrame& frame,
                                             const Features& features) {
  LocatedFrame result;
  result.number = number;
  result.stamp = frame.stamp;
  if (state_ != State::kSearching) follow(frame, features, result);

  // A lost track refutes the place on probation
  std::vector<LocatedFrame> certain;
  if (!result.located && state_ == State::kOnProbation) {
    refuse_waiting("the next frames did not confirm the place");
    certain.swap(waiting_);
  }

  // Without a track the whole map is searched
  if (!result.located) search(frame, features, result);
  if (state_ != State::kOnProbation) {
    certain.push_back(std::move(result));
    return certain;
  }

  // A place is believed once it was tracked for a while and the image is recognised there again.
  waiting_.push_back(std::move(result));
  if (static_cast<int>(waiting_.size()) >= options_.confirm &&
      places_.confirms(frame, features, around_.local_map.reference, tracker_.lost().camera_from_world)) {
    state_ = State::kLocated;
  } else if (waiting_.size() >= kMostWaiting) {
    refuse_waiting("the place could not be confirmed");
  }

  if (state_ != State::kOnProbation) {
    std::move(waiting_.begin(), waiting_.end(), std::back_inserter(certain));
    waiting_.clear();
  }
  return certain;
}

std::vector<LocatedFrame> Localizer::finish() {
  refuse_waiting("the recording ended before the place was confirmed");
  return std::exchange(waiting_, {});
}

/// Frames of a place that was not confirmed are reported as not located.
void Localizer::refuse_waiting(const std::string& reason) {
  for (LocatedFrame& frame : waiting_) {
    frame.located = false;
    frame.how.clear();
    frame.reason = reason;
  }
  state_ = State::kSearching;
}

/// The features as if all rows had been read at once, by the mean motion of the last steps. The tracker's own
/// correction, by the motion that the present pose tells, amplifies what that pose is off where matches lie
/// in a part of the image only.
Localizer::Features Localizer::without_shutter(const Features& features) const {
  if (readout_s_ == 0.0 || path_.size() < 2) return features;
  const auto& [last_stamp, last] = path_.back();
  const auto& [first_stamp, first] = path_.front();
  const geometry::Vector6d velocity = geometry::log_se3(last * first.inverse()) / (last_stamp - first_stamp);
  auto result = std::make_shared<features::FrameFeatures>(*features);
  features::undo_rolling_shutter(*result, camera_, velocity, readout_s_);
  return result;
}

/// Tracks the frame from the one before.
void Localizer::follow(const sensor::RgbdFrame& frame, const Features& features, LocatedFrame& result) {
  const tracking::TrackResult track = tracker_.follow(map_.map, around_, frame, without_shutter(features));
  result.reason = doubt(track);
  result.located = result.reason.empty();
  if (!result.located) {
    path_.clear();
    if (++missed_ >= kForgotten) state_ = State::kSearching;
    return;
  }
  missed_ = 0;
  result.how = "tracked";
  take(track, result);
}

/// Looks for the frame in the whole map. What is found near the last pose continues from there; any other
/// place is on probation.
void Localizer::search(const sensor::RgbdFrame& frame, const Features& features, LocatedFrame& result) {
  const PlaceAnswer answer = places_.find(frame, features);
  if (!answer.keyframe) {
    if (result.reason.empty() || missed_ > kStillThere) result.reason = answer.reason;
    return;
  }

  // Aligned with the map around.
  const bool stays = state_ == State::kLocated && missed_ <= kStillThere &&
                     mapping::is_near(answer.camera_from_world, tracker_.lost().camera_from_world,
                                      kStillThere_m, kStillThere_rad);
  tracker_.begin_at(answer.camera_from_world, frame, features);
  look_around(*answer.keyframe);
  const tracking::TrackResult track = tracker_.follow(map_.map, around_, frame, features);

  const std::string doubtful = doubt(track);
  result.located = doubtful.empty();
  if (!result.located) {
    result.reason = "looks like a place, but " + doubtful;
    state_ = State::kSearching;
    return;
  }

  // A place near the last pose needs no confirmation
  missed_ = 0;
  result.reason.clear();
  result.how = "place";
  path_.clear();
  take(track, result);
  state_ = stays ? State::kLocated : State::kOnProbation;
}

void Localizer::take(const tracking::TrackResult& track, LocatedFrame& result) {
  result.map_from_camera = map_.output_from_map * track.camera_from_world.inverse();
  result.keyframe = track.reference;
  result.points = static_cast<int>(track.points.size());
  result.lines = static_cast<int>(track.lines.size());
  result.found = share_found(track);
  result.surface_share = track.surface_share;

  // Accuracy: covariance of the pose, enlarged by the errors that all landmarks of the view share.
  const geometry::Matrix6d covariance =
      (track.estimate.information + 1e-3 * geometry::Matrix6d::Identity()).inverse();
  const double depth_m = depth_of(track);
  const double common_m = kPerDistance * distance_from_map(track.camera_from_world, depth_m);
  const double common_rad = common_m / depth_m;
  result.sigma_position_m =
      std::sqrt(covariance.topLeftCorner<3, 3>().trace() + kFloor_m * kFloor_m + common_m * common_m);
  result.sigma_rotation_rad = std::sqrt(covariance.bottomRightCorner<3, 3>().trace() +
                                        kFloor_rad * kFloor_rad + common_rad * common_rad);

  // The last poses give the mean motion
  if (path_.size() > kSmoothed) path_.pop_front();
  path_.emplace_back(result.stamp, track.camera_from_world);
  move_reference(track);
}

/// The distance of the nearest of the views around that were mapped, metres.
double Localizer::distance_from_map(const Rigid3& camera_from_world, double depth_m) const {
  double least = std::numeric_limits<double>::max();
  for (const KeyframeId id : around_.local_map.keyframes)
    least = std::min(least, distance(camera_from_world, map_.map.camera_from_world(id), depth_m));
  return least;
}

/// Why the tracker's pose is not believed; empty: it is.
std::string Localizer::doubt(const tracking::TrackResult& track) const {
  if (track.state != tracking::TrackState::kTracked) return "nothing of the map agrees with the image";
  if (track.degenerate_directions > 0 || track.dead_reckoned)
    return "a direction of the pose is not measured";
  const double weakest_m = 1.0 / std::sqrt(std::max(track.min_eigenvalue, 1.0));
  if (weakest_m > kInaccurate_m) return fmt::format("the pose is known to {:.0f} mm only", 1e3 * weakest_m);

  // Surfaces alone fit by chance, unless there is nothing else to be seen and nearly all of them do.
  const int found = landmarks(track.points.size(), track.lines.size());
  const int visible = landmarks(track.visible_points.size(), track.visible_lines.size());
  const bool bare = visible < kFewInView && track.surface_share >= tracking::kMostOfTheSurface;
  const double least_share = found >= kMany ? 0.5 * options_.min_found : options_.min_found;
  if (bare || (found >= options_.min_features && found >= least_share * visible)) return {};
  return fmt::format("{} of {} landmarks in view agree", found, visible);
}

/// The local map follows the camera: to the keyframe that shares clearly more landmarks with the frame than
/// the present one; where there are few, to one that is clearly nearer.
void Localizer::move_reference(const tracking::TrackResult& track) {
  constexpr double kClearly = 1.2;
  constexpr int kEnough = 20;

  // Landmarks that the frame shares with each keyframe
  std::map<KeyframeId, int> common;
  const auto count = [&](const std::vector<maps::Observation>& observations) {
    for (const maps::Observation& o : observations) ++common[o.keyframe];
  };
  for (const auto& match : track.points) count(map_.map.point(match.point).observations);
  for (const auto& match : track.lines) count(map_.map.line(match.line).observations);

  // Hysteresis avoids switching to and fro
  KeyframeId best = track.reference;
  double most = std::max(kClearly * common[best], static_cast<double>(kEnough));
  for (const auto& [id, landmarks] : common) {
    if (landmarks <= most) continue;
    best = id;
    most = landmarks;
  }

  // With few shared landmarks the distance decides
  const bool alone = best == track.reference && common[best] < kEnough;
  if (alone) best = nearest(map_.map, track.camera_from_world, best, kClearly);
  if (best != track.reference) look_around(best);
}

void Localizer::look_around(KeyframeId reference) {
  around_.local_map = tracking::build_local_map(map_.map, reference, options_.tracker.local_map);
}

}  // namespace plumbline::localize
