// SPDX-License-Identifier: BSD-3-Clause
// Verdict on a pose that was found.
#include "alignment/frame_aligner.hpp"
#include "observable_directions.hpp"

namespace plumbline::tracking {
namespace {

constexpr double kBlind = 100.0;  // information of a standard deviation of 10 cm
constexpr double kNoisy = 1e4;    // of 1 cm: a step of that accuracy is noise more than motion
constexpr double kAllTheSurface = 0.9;
constexpr double kNearlyHeld = 0.5;  // of the information that a direction needs

}  // namespace

/// True if measurements contradict the motion model in directions that surfaces seem not to constrain: after
/// a second along a bare wall it may be wrong by centimetres when the edge of a door comes into view. Only
/// measurements that constrain every direction by themselves can contradict it: in front of a bare wall,
/// chance would. The pose becomes the measured one.
bool FrameAligner::contradicts_motion_prior() {
  // Reduction of the cost: at most 1 if the model was right, soon above 8 if it was not.
  constexpr double kGain = 4.0;
  if (!use_motion_prior_ || !surface_only_ || !problem_.prior) return false;
  optimize::PoseProblem problem = problem_;
  problem.prior = motion_prior(result_.estimate.information, predicted_, MotionTrust::kUnknown);
  if (problem.prior) return false;
  optimize::PoseSolverOptions solver = in_.options.solver;
  solver.max_iterations = 8;
  const optimize::PoseSummary freed = optimize::solve_pose(problem, result_.camera_from_world, solver);
  if (freed.initial_cost - freed.final_cost < kGain) return false;
  result_.camera_from_world = freed.camera_from_world;
  return true;
}

/// Information without families that are not trusted: a few chance matches must not hold directions that a
/// wall leaves free. Takes the problem apart.
geometry::Matrix6d FrameAligner::trusted_information(bool by_features, bool by_surface) {
  if (by_features == by_surface) return result_.estimate.information;
  if (by_features) problem_.planes.clear();
  if (by_surface) problem_.points.clear();
  if (by_surface) problem_.lines.clear();
  optimize::PoseSolverOptions evaluate_only = in_.options.solver;
  evaluate_only.max_iterations = 0;
  return optimize::solve_pose(problem_, result_.camera_from_world, evaluate_only).information;
}

/// Every direction must be constrained by families that can be trusted.
void FrameAligner::judge() {
  const optimize::PoseSummary& estimate = result_.estimate;
  result_.motion_contradicted = surface_only_ && !use_motion_prior_ &&
                                !motion_prior(estimate.information, predicted_, MotionTrust::kUnknown);
  if (result_.surface_in_view > 0)
    result_.surface_share = static_cast<double>(estimate.planes.inliers) / result_.surface_in_view;

  // Degenerate directions of the trusted information
  const bool by_features = feature_inliers() >= in_.options.min_inliers;
  const bool by_surface = estimate.planes.inliers >= in_.options.min_surface && result_.surface_share > 0.5;
  const geometry::Matrix6d information = trusted_information(by_features, by_surface);
  const PrincipalDirections directions = principal_directions(information);
  result_.min_eigenvalue = directions.eigenvalues(0);
  const double limit = degenerate_below(information, uses_features() && !by_features);
  result_.degenerate_directions = static_cast<int>((directions.eigenvalues.array() < limit).count());

  // Far corners or one wall leave a direction to the motion model. It may hold that for a while, if the
  // matches are not mere chance.
  const bool many = feature_inliers() >= 3 * in_.options.min_inliers && result_.min_eigenvalue >= kBlind;

  // A direction that falls short by a little is not yet a chance fit, though some of the surface does not
  // fit.
  const bool nearly = result_.min_eigenvalue >= kNearlyHeld * limit;
  const bool all_surface =
      by_surface && result_.surface_share > (nearly ? kMostOfTheSurface : kAllTheSurface);
  result_.dead_reckoned = result_.degenerate_directions > 0 && !(by_features && by_surface);
  result_.onto_degenerate =
      result_.dead_reckoned ? projector_onto_degenerate(directions, limit)
                            : projector_onto_degenerate(principal_directions(estimate.information), kNoisy);

  // Tracked if constrained, by measurements or dead reckoning
  const bool constrained = result_.dead_reckoned
                               ? in_.motion.may_dead_reckon() && ((by_features && many) || all_surface)
                               : by_features || by_surface;
  const bool tracked = constrained && result_.camera_from_world.translation.allFinite();
  result_.state = tracked ? TrackState::kTracked : TrackState::kLost;
  if (!tracked) result_.loss = by_features || by_surface ? Loss::kFreeDirection : Loss::kFewAgree;
}

}  // namespace plumbline::tracking
