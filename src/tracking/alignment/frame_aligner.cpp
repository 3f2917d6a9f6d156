// SPDX-License-Identifier: BSD-3-Clause
#include "alignment/frame_aligner.hpp"

#include <algorithm>
#include <cmath>

#include "observable_directions.hpp"
#include "plumbline/tracking/align_points.hpp"
#include "plumbline/tracking/pose_terms.hpp"

namespace plumbline::tracking {
namespace {

using geometry::Rigid3;

constexpr AlignmentRound kCoarse[] = {
    // search, plane, samples, level, rematch, reject outliers
    {0.0, 0.15, 500, 1, true, false},
    {0.0, 0.08, 700, 1, false, false}};
constexpr AlignmentRound kFine[] = {{kFineRadius_px, 0.05, 1200, 0, true, true},
                                    {kFineRadius_px, 0.03, 2400, 0, false, true},
                                    {kFineRadius_px, 0.03, 2400, 0, false, false}};

constexpr int kIterations = 3;      // per round; the next one associates again
constexpr double kPointGate = 7.8;  // chi-square, 2 degrees of freedom, 98 %
constexpr double kLineGate = 9.2;   // 99 %: line ends are less exact than corners
constexpr double kLineSigma_px = 0.6;

}  // namespace

FrameAligner::FrameAligner(const AlignmentInput& input, const Rigid3& hypothesis, double search_radius_px)
    : in_(input),
      search_radius_px_(search_radius_px),
      predicted_(input.motion.continuous() ? input.motion.predict(input.image.frame.stamp) : hypothesis),
      motion_(input.image.motion),
      use_motion_prior_(!input.motion.contradicted()) {
  problem_.camera = in_.camera;
  result_.camera_from_world = hypothesis;
  result_.depth_from_camera = motion_.depth_from_camera;
}

TrackResult FrameAligner::run() {
  // With a search radius: coarse rounds first
  if (search_radius_px_ > 0.0) {
    for (const AlignmentRound& round : kCoarse) align(round);
    correct_image_motion();
  }
  align_finely();

  // Again without the prior, if measurements contradict it
  if (contradicts_motion_prior()) {
    use_motion_prior_ = false;
    align_finely();
  }
  judge();
  return std::move(result_);
}

void FrameAligner::align_finely() {
  align(kFine[0]);
  AlignmentRound next = kFine[1];
  next.rematch = correct_image_motion();
  align(next);
  align(kFine[2]);
}

// One round of association and optimisation.
void FrameAligner::align(const AlignmentRound& round) {
  if (round.rematch) match_landmarks(round);  // points and lines, by projection: e_p and e_l of section 3.2
  associate_surface(round);                   // point to plane
  associate_intensity(round);                 // direct alignment
  solve();                                    // Levenberg-Marquardt with all families
  constrain_degenerate_directions();          // by the motion prior
  if (round.reject_outliers) reject_outliers();  // chi-square gates
}

/// Synchronises the features again: the motion model, with which that was done, lags behind a changing
/// motion, which is now known from the pose. True if that moved them.
bool FrameAligner::correct_image_motion() {
  constexpr double kLeast_px = 0.1;
  const double readout_s = in_.options.readout_s;
  const double delay_s = in_.depth_delay_s;
  if (readout_s == 0.0 && delay_s == 0.0) return false;

  // Velocities that follow from the new pose
  const Rigid3& pose = result_.camera_from_world;
  const auto at_stamp = in_.motion.velocity_after(frame().stamp, pose, 0.0);
  const auto until_depth = in_.motion.velocity_after(frame().stamp, pose, delay_s);
  if (!at_stamp || !until_depth) return false;

  // An error of the pose moves the late depth image further than the pose: a whole step towards each new
  // estimate would overshoot.
  const double ahead = std::max(0.0, delay_s) / (frame().stamp - in_.motion.last_stamp());
  const geometry::Vector6d change =
      (delay_s * *until_depth - geometry::log_se3(motion_.depth_from_camera)) / (1.0 + ahead);
  const ImageMotion motion{readout_s * *at_stamp, geometry::exp_se3(change) * motion_.depth_from_camera};

  // Shift of features at a typical distance
  constexpr double kDistance_m = 1.5;  // of what is seen
  const geometry::Vector6d shutter_change = 0.5 * (motion.shutter - motion_.shutter);
  const double moved_px =
      in_.camera.fx *
      std::max(change.head<3>().norm() / kDistance_m + change.tail<3>().norm(),
               shutter_change.head<3>().norm() / kDistance_m + shutter_change.tail<3>().norm());
  if (moved_px < kLeast_px) return false;

  motion_ = motion;
  result_.features = synchronised(in_.image.measured, frame().depth, in_.camera, motion_);
  result_.depth_from_camera = motion_.depth_from_camera;
  intensity_level_.reset();
  return true;
}

void FrameAligner::match_landmarks(const AlignmentRound& round) {
  const double radius = round.search_radius_px > 0.0 ? round.search_radius_px : search_radius_px_;
  const AssociationOptions& how = in_.options.association;
  const Rigid3& pose = result_.camera_from_world;

  // Landmarks of the previous round are replaced
  result_.visible_points.clear();
  result_.visible_lines.clear();
  result_.doubtful.clear();

  if (in_.options.points) {
    result_.points = match_points(in_.map, in_.around.local_map.points, {features(), in_.camera, pose},
                                  radius, how, &result_.visible_points);

    // Corners are aligned once outliers are rejected
    if (how.align && round.reject_outliers)
      align_points(in_.map, features(), in_.camera, pose, how.scale_factor, result_.points);
    problem_.points = point_terms(in_.map, result_.points, features(), how);
  }

  if (in_.options.lines) {
    result_.lines = match_lines(in_.map, in_.around.local_map.lines, {features(), in_.camera, pose}, radius,
                                how, &result_.visible_lines);
    problem_.lines = line_terms(in_.map, result_.lines, features(), kLineSigma_px);
  }
}

void FrameAligner::associate_surface(const AlignmentRound& round) {
  if (!in_.options.depth) return;

  // Coarse rounds have wider gates
  SurfaceAssociationOptions how;
  how.max_distance_m = round.max_plane_distance_m;
  how.max_samples = round.surface_samples;
  how.max_depth_m = in_.around.local_map.max_surface_depth_m;
  problem_.planes = tracking::associate_surface(
      in_.around.local_map.surface,
      {frame().depth, in_.camera, result_.camera_from_world, motion_.depth_from_camera}, how,
      &result_.surface_in_view);
}

void FrameAligner::associate_intensity(const AlignmentRound& round) {
  if (!in_.options.photometric || features().photometric == nullptr) return;

  // Terms of the same pyramid level are only updated
  const bool again = intensity_level_ == round.pyramid_level && problem_.photometric &&
                     update_photometric(*problem_.photometric, result_.camera_from_world);
  if (!again) {
    problem_.photometric = in_.around.photometric.associate(
        in_.map, in_.around.local_map.keyframes, round.pyramid_level,
        {features().photometric.get(), &frame().depth, motion_.depth_from_camera, in_.camera},
        result_.camera_from_world);
  }
  intensity_level_ = round.pyramid_level;
}

/// Solves for the pose; again without the intensity terms if they disagree.
void FrameAligner::solve() {
  optimize::PoseSolverOptions solver = in_.options.solver;
  solver.max_iterations = kIterations;
  result_.estimate = optimize::solve_pose(problem_, result_.camera_from_world, solver);
  if (problem_.photometric &&
      !photometric_agrees(*problem_.photometric, result_.estimate.camera_from_world)) {
    problem_.photometric.reset();
    result_.estimate = optimize::solve_pose(problem_, result_.camera_from_world, solver);
  }
  result_.camera_from_world = result_.estimate.camera_from_world;
}

void FrameAligner::constrain_degenerate_directions() {
  surface_only_ = uses_features() && !problem_.photometric && feature_inliers() < in_.options.min_inliers;
  if (!in_.options.motion_prior) return;
  MotionTrust trust = MotionTrust::kUnknown;
  if (use_motion_prior_ && surface_only_) trust = MotionTrust::kSurfaceOnly;
  // Wheels slip: with features in view they count less.
  if (use_motion_prior_ && !surface_only_ && in_.motion.reliable(frame().stamp) && !in_.motion.knows_wheels())
    trust = MotionTrust::kLikely;
  problem_.prior = motion_prior(result_.estimate.information, predicted_, trust);
}

void FrameAligner::reject_outliers() {
  const std::vector<double> errors = optimize::point_errors(problem_, result_.camera_from_world);

  // Aligned points that do not fit are doubtful
  for (std::size_t i = 0; i < errors.size(); ++i) {
    if (errors[i] > kPointGate && result_.points[i].aligned) result_.doubtful.push_back(result_.points[i]);
  }
  keep_inliers(errors, kPointGate, result_.points, problem_.points);
  keep_inliers(optimize::line_errors(problem_, result_.camera_from_world), kLineGate, result_.lines,
               problem_.lines);
}

int FrameAligner::feature_inliers() const {
  return result_.estimate.points.inliers + 2 * result_.estimate.lines.inliers;
}

}  // namespace plumbline::tracking
