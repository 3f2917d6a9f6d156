// SPDX-License-Identifier: BSD-3-Clause
// Where the tracker looks for the camera, and which of the poses found from there it takes.
#include <algorithm>

#include "plumbline/tracking/thumbnail_alignment.hpp"
#include "plumbline/tracking/tracker.hpp"

namespace plumbline::tracking {

using geometry::Rigid3;

Tracker::Guesses Tracker::guesses(const maps::Map& map, const sensor::RgbdFrame& frame,
                                  const features::FrameFeatures& features) const {
  Guesses result;
  const Rigid3 predicted = predict(frame.stamp);
  if (options_.pnp_start) {
    const auto seen = relocalise(map, {local_map_.reference}, features, camera_, options_.min_inliers);
    if (seen) result.poses.push_back(seen->camera_from_world);
  }
  if (options_.thumbnails) {
    const ThumbnailAlignment alignment =
        align_thumbnails(last_.thumbnail, last_.thumbnail_depth, features.thumbnail, camera_,
                         predicted * last_.camera_from_world.inverse());
    if (alignment.better) result.poses.push_back(alignment.current_from_previous * last_.camera_from_world);
  }
  result.poses.push_back(predicted);
  result.poses.push_back(last_.camera_from_world);
  if (options_.photometric)
    put_likeliest_first(map, {features.photometric.get(), &frame.depth, {}, camera_}, result);
  return result;
}

/// Terms that bear a pose out, each family with its weight.
double Tracker::evidence(const TrackResult& result) const {
  const optimize::PoseSummary& seen = result.estimate;
  const optimize::PoseSolverOptions& weights = options_.solver;
  return weights.point_weight * seen.points.inliers + weights.line_weight * 2 * seen.lines.inliers +
         weights.plane_weight * seen.planes.inliers + weights.photometric_weight * seen.photometric.inliers;
}

/// Whether the camera would have been jolted as no hand or wheel does between two frames.
bool Tracker::leaps(double stamp, const Rigid3& camera_from_world) const {
  constexpr double kMost_m = 0.03;
  constexpr double kMost_rad = 0.03;
  if (!knows_motion(stamp)) return false;
  const Rigid3 leap = camera_from_world * predict(stamp).inverse();
  return leap.translation.norm() > kMost_m || geometry::rotation_angle(leap.rotation) > kMost_rad;
}

std::optional<TrackResult> Tracker::by_motion(const maps::Map& map, const sensor::RgbdFrame& frame,
                                              const features::FrameFeatures& features) const {
  constexpr double kClearly = 1.15;  // more must bear a leap out than what is near the guess
  if (lost_frames_ >= 30) return std::nullopt;
  const Guesses guesses = this->guesses(map, frame, features);
  const auto tracked = [&](const TrackResult& attempt) {
    return attempt.state == TrackState::kTracked && (!stale() || beyond_doubt(attempt));
  };
  std::optional<TrackResult> best;
  for (std::size_t i = 0; i < guesses.poses.size(); ++i) {
    const Rigid3& guess = guesses.poses[i];
    TrackResult attempt = estimate(map, frame, features, guess, 12.0 + 4.0 * std::min(lost_frames_, 5));
    // Among look-alikes, the keys of a keyboard, wrong matches of the wide search can pull the pose further
    // than the fine rounds look: the right ones around the guess would never be tried.
    if (leaps(frame.stamp, attempt.camera_from_world)) {
      TrackResult near = estimate(map, frame, features, guess, 0.0);
      if (tracked(near) && !(tracked(attempt) && evidence(attempt) > kClearly * evidence(near)))
        attempt = std::move(near);
    }
    if (tracked(attempt) && (!best || evidence(attempt) > evidence(*best))) best = std::move(attempt);
    if (best && !guesses.sought) break;
  }
  return best;
}

std::vector<Tracker::Guess> Tracker::guesses_by_picture(const maps::Map& map,
                                                        const features::FrameFeatures& features) const {
  constexpr int kLookAlikes = 24;
  constexpr std::size_t kAligned = 3;
  std::vector<LookAlike> alike;
  if (options_.thumbnails) alike = look_alikes(map, map.keyframe_ids(), features, kLookAlikes);
  std::vector<Guess> guesses;
  if (options_.points) {
    std::vector<core::KeyframeId> candidates;
    const auto add = [&candidates](core::KeyframeId id) {
      if (std::find(candidates.begin(), candidates.end(), id) == candidates.end()) candidates.push_back(id);
    };
    for (core::KeyframeId id : local_map_.keyframes) add(id);
    if (find_places_) {
      for (core::KeyframeId id : find_places_(features)) add(id);
    }
    for (const LookAlike& a : alike) add(a.keyframe);
    const auto seen = relocalise(map, candidates, features, camera_, options_.min_inliers);
    if (seen) guesses.push_back({seen->keyframe, seen->camera_from_world, false});
  }
  for (std::size_t i = 0; i < std::min(kAligned, alike.size()); ++i) {
    const core::KeyframeId id = alike[i].keyframe;
    guesses.push_back({id, align_look_alike(map, id, features, camera_), true});
  }
  return guesses;
}

std::optional<TrackResult> Tracker::by_picture(const maps::Map& map, const sensor::RgbdFrame& frame,
                                               const features::FrameFeatures& features) {
  const std::vector<Guess> guesses = guesses_by_picture(map, features);
  LocalMap before = std::move(local_map_);
  for (const Guess& guess : guesses) {
    local_map_ = build_local_map(map, guess.keyframe, options_.local_map);
    TrackResult attempt = estimate(map, frame, features, guess.camera_from_world, guess.rough ? 24.0 : 10.0);
    if (attempt.state != TrackState::kTracked || attempt.held_by_motion) continue;
    if (guess.rough && !beyond_doubt(attempt)) continue;
    if (is_place_ && !is_place_(frame, features, guess.keyframe, attempt.camera_from_world)) continue;
    attempt.relocalised = true;
    stand();
    last_.valid = false;
    return attempt;
  }
  local_map_ = std::move(before);  // a mistake must not take the surroundings away
  return std::nullopt;
}

}  // namespace plumbline::tracking
