// SPDX-License-Identifier: BSD-3-Clause
// Start poses for the search for the camera, and the choice among the poses found from them.
#include <algorithm>
#include <cmath>

#include "alignment/frame_aligner.hpp"
#include "alignment/photometric_view.hpp"
#include "plumbline/tracking/thumbnail_alignment.hpp"

namespace plumbline::tracking {

using geometry::Rigid3;

namespace {

/// Photometric terms of the first keyframe around that has enough of its samples in the view.
std::optional<optimize::PhotometricFamily> comparable(const Surroundings& around, const maps::Map& map,
                                                      std::size_t level, const PhotometricView& view,
                                                      const Rigid3& camera_from_world) {
  for (const core::KeyframeId id : around.local_map.keyframes) {
    const auto samples = around.photometric.find(id);
    if (samples == nullptr) continue;
    auto family = photometric_in_view(*samples, level, view, map.camera_from_world(id), camera_from_world);
    if (!family) continue;
    const std::vector<float> seen = optimize::photometric_residuals(*family, camera_from_world);
    const auto hidden = std::count_if(seen.begin(), seen.end(), [](float r) { return std::isnan(r); });
    if (static_cast<std::ptrdiff_t>(seen.size()) - hidden >= kMinPhotometric) return family;
  }
  return std::nullopt;
}

}  // namespace

TrackResult Tracker::align(const Scene& scene, const TrackedImage& image, const Rigid3& hypothesis,
                           double search_radius_px) const {
  const AlignmentInput input{
      options_, camera_, scene.map, scene.around, motion_, image, depth_delay_s(image.frame)};
  return FrameAligner(input, hypothesis, search_radius_px).run();
}

Tracker::PoseHypotheses Tracker::pose_hypotheses(const Scene& scene, const sensor::RgbdFrame& frame,
                                                 const features::FrameFeatures& features) const {
  PoseHypotheses result;
  const Rigid3 predicted = motion_.predict(frame.stamp);
  const Rigid3& last = motion_.camera_from_world();

  if (options_.pnp_start) {  // METHOD section 2: PnP, then Levenberg-Marquardt
    const auto seen = tracking::relocalise(scene.map, {scene.around.local_map.reference}, features, camera_,
                                           options_.min_inliers);
    if (seen) result.camera_from_world.push_back(seen->camera_from_world);
    result.searched = seen.has_value();
  }

  // Most reliable first: sensors, thumbnails, motion model
  const bool sensed = motion_.knows_turn() || motion_.knows_wheels();
  if (sensed) result.camera_from_world.push_back(predicted);
  if (options_.thumbnails) {
    const ThumbnailAlignment alignment = align_thumbnails(thumbnail_, thumbnail_depth_, features.thumbnail,
                                                          camera_, predicted * last.inverse());
    if (alignment.better) result.camera_from_world.push_back(alignment.current_from_previous * last);
  }

  if (!sensed) result.camera_from_world.push_back(predicted);
  result.camera_from_world.push_back(last);

  // Intensity may show which one is the best
  if (options_.photometric && features.photometric != nullptr)
    rank_by_intensity(scene, {features.photometric.get(), &frame.depth, {}, camera_}, result);
  return result;
}

/// In front of a bare wall thumbnails fit anywhere, and the motion model lags behind: fine texture shows
/// which hypothesis is the best, or how far to the side of it the camera points.
void Tracker::rank_by_intensity(const Scene& scene, const PhotometricView& view,
                                PoseHypotheses& hypotheses) const {
  constexpr std::size_t kCoarse = 1;
  constexpr double kSure = 0.3;  // smallest correlation of a shifted pose
  std::vector<Rigid3>& poses = hypotheses.camera_from_world;
  std::vector<std::optional<double>> agreement;
  std::vector<std::optional<optimize::PhotometricFamily>> families;

  // Agreement of each hypothesis with a keyframe's intensity
  for (const Rigid3& pose : poses) {
    const auto& family = families.emplace_back(comparable(scene.around, scene.map, kCoarse, view, pose));
    agreement.push_back(family
                            ? std::optional(optimize::photometric_correlation(*family, pose, kMinPhotometric))
                            : std::nullopt);
  }

  // The best one comes first
  const std::size_t best = best_hypothesis(agreement);
  const Rigid3 likeliest = poses[best];
  if (best > 0) {
    poses.erase(poses.begin() + static_cast<std::ptrdiff_t>(best));
    poses.insert(poses.begin(), likeliest);
  }
  if (!families[best] || *agreement[best] >= kGoodAgreement) return;

  // None is good: search around the best one
  const ShiftedPose shifted = search_shift(*families[best], likeliest);
  if (shifted.correlation < std::max(kSure, *agreement[best] + kBetterAgreement)) return;
  poses.insert(poses.begin(), shifted.camera_from_world);
  hypotheses.searched = true;
}

/// Terms that confirm a pose, each family with its weight.
double Tracker::support(const TrackResult& result) const {
  const optimize::PoseSummary& seen = result.estimate;
  const optimize::PoseSolverOptions& weights = options_.solver;
  return weights.point_weight * seen.points.inliers + weights.line_weight * 2 * seen.lines.inliers +
         weights.plane_weight * seen.planes.inliers + weights.photometric_weight * seen.photometric.inliers;
}

/// True if the camera would have jumped farther than a hand or a wheel moves it between two frames.
bool Tracker::jumps(double stamp, const Rigid3& camera_from_world) const {
  constexpr double kMost_m = 0.03;
  constexpr double kMost_rad = 0.03;
  if (!motion_.reliable(stamp)) return false;
  const Rigid3 jump = camera_from_world * motion_.predict(stamp).inverse();
  return jump.translation.norm() > kMost_m || geometry::rotation_angle(jump.rotation) > kMost_rad;
}

Tracker::Found Tracker::track_with_motion_model(const Scene& scene, const TrackedImage& image) const {
  constexpr double kClearly = 1.15;  // more support than the pose near by, or than the likeliest one
  if (motion_.expired()) return tl::unexpected(Loss::kNoPlace);

  const features::FrameFeatures& features = *image.synchronised;
  const PoseHypotheses hypotheses = pose_hypotheses(scene, image.frame, features);

  const auto tracked = [&](const TrackResult& attempt) {
    return attempt.state == TrackState::kTracked &&
           (!motion_.outdated() || passes_strict_check(attempt, features));
  };

  std::optional<TrackResult> best;
  Loss loss = Loss::kNoPlace;  // of the attempt with most support among those that failed
  double most = -1.0;
  for (const Rigid3& hypothesis : hypotheses.camera_from_world) {
    TrackResult attempt = align(scene, image, hypothesis, motion_.search_radius_px());

    // Among similar landmarks, such as the keys of a keyboard, wrong matches of the wide search can pull the
    // pose beyond the reach of the fine rounds: the right ones around the hypothesis would never be tried.
    if (jumps(image.frame.stamp, attempt.camera_from_world)) {
      TrackResult near = align(scene, image, hypothesis, 0.0);
      if (tracked(near) && !(tracked(attempt) && support(attempt) > kClearly * support(near)))
        attempt = std::move(near);
    }

    if (!tracked(attempt) && support(attempt) > most) {
      most = support(attempt);
      loss = attempt.state == TrackState::kTracked ? Loss::kUnlikely : attempt.loss;
    }

    const double share = hypotheses.searched ? 1.0 : kClearly;
    if (tracked(attempt) && (!best || support(attempt) > share * support(*best))) best = std::move(attempt);
    // A pose that jumps may fit another copy of the same landmarks: the other hypotheses are tried as well.
    if (best && !hypotheses.searched && !jumps(image.frame.stamp, best->camera_from_world)) break;
  }

  if (!best) return tl::unexpected(loss);
  return *std::move(best);
}

std::vector<Tracker::PlaceHypothesis> Tracker::place_hypotheses(
    const Scene& scene, const features::FrameFeatures& features) const {
  const maps::Map& map = scene.map;
  constexpr int kLookAlikes = 24;
  constexpr std::size_t kAligned = 3;
  std::vector<LookAlike> alike;
  if (options_.thumbnails) alike = look_alikes(map, map.keyframe_ids(), features, kLookAlikes);

  std::vector<PlaceHypothesis> hypotheses;
  if (options_.points && !features.points.empty()) {
    // From the local map, place recognition and thumbnails
    std::vector<core::KeyframeId> candidates;
    const auto add = [&candidates](core::KeyframeId id) {
      if (std::find(candidates.begin(), candidates.end(), id) == candidates.end()) candidates.push_back(id);
    };

    for (core::KeyframeId id : scene.around.local_map.keyframes) add(id);
    if (scene.relocaliser != nullptr) {
      for (core::KeyframeId id : scene.relocaliser->look_alikes(map, features)) add(id);
    }
    for (const LookAlike& a : alike) add(a.keyframe);

    const auto seen = tracking::relocalise(map, candidates, features, camera_, options_.min_inliers);
    if (seen) hypotheses.push_back({seen->keyframe, seen->camera_from_world, false});
  }

  // Poses from the most similar thumbnails are coarse
  for (std::size_t i = 0; i < std::min(kAligned, alike.size()); ++i) {
    const core::KeyframeId id = alike[i].keyframe;
    hypotheses.push_back({id, align_look_alike(map, id, features, camera_), true});
  }

  return hypotheses;
}

Tracker::Found Tracker::relocalise(const Scene& scene, const TrackedImage& image) {
  const features::FrameFeatures& features = *image.synchronised;
  const std::vector<PlaceHypothesis> hypotheses = place_hypotheses(scene, features);
  LocalMap& local_map = scene.around.local_map;
  LocalMap before = std::move(local_map);

  // The first place that passes all checks
  for (const PlaceHypothesis& place : hypotheses) {
    local_map = build_local_map(scene.map, place.keyframe, options_.local_map);
    TrackResult attempt = align(scene, image, place.camera_from_world, place.coarse ? 24.0 : 10.0);

    if (attempt.state != TrackState::kTracked || attempt.dead_reckoned) continue;
    if (place.coarse && !passes_strict_check(attempt, features)) continue;
    const FoundFrame found{image.frame, features, place.keyframe, attempt.camera_from_world};
    if (scene.relocaliser != nullptr && !scene.relocaliser->is_place(scene.map, lost(), found)) continue;

    attempt.relocalised = true;
    motion_.reset();
    return attempt;
  }
  local_map = std::move(before);  // a mistake must not take the surroundings away
  return tl::unexpected(Loss::kNoPlace);
}

/// Stricter check, because places can look alike: a pose that only the thumbnail suggested must be confirmed
/// by every family that is in use and has evidence there.
bool Tracker::passes_strict_check(const TrackResult& result, const features::FrameFeatures& features) const {
  constexpr double kMostOfTheFeatures = 0.4;  // of the landmarks that should be seen
  if (result.degenerate_directions > 0) return false;
  if (options_.depth &&
      (result.estimate.planes.inliers < options_.min_surface || result.surface_share < kMostOfTheSurface)) {
    return false;
  }
  if (!features.extracted() || (!options_.points && !options_.lines)) return true;
  const auto found = static_cast<double>(result.points.size() + 2 * result.lines.size());
  const auto expected = static_cast<double>(result.visible_points.size() + 2 * result.visible_lines.size());
  return found >= options_.min_inliers && found >= kMostOfTheFeatures * expected;
}

}  // namespace plumbline::tracking
