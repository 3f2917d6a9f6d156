// SPDX-License-Identifier: BSD-3-Clause
// What a pose that was found is worth.
#include "observable_directions.hpp"
#include "plumbline/tracking/tracker.hpp"

namespace plumbline::tracking {
namespace {

using geometry::Rigid3;

constexpr double kBlind = 100.0;  // information of a standard deviation of 10 cm
constexpr double kNoisy = 1e4;    // of 1 cm: a step of that accuracy is noise more than motion
constexpr double kAllTheSurface = 0.9;
constexpr double kMostOfTheSurface = 0.75;
constexpr double kNearlyHeld = 0.5;  // of the information that a direction needs
constexpr double kLongestDeadReckoning_s = 2.5;

}  // namespace

/// Whether what is seen speaks against the motion model where that holds what surfaces seem not to: after a
/// second along a bare wall it may be wrong by centimetres when the edge of a door comes into view. Only what
/// holds every direction by itself can: before the wall alone, chance speaks for anything. `pose` becomes the
/// one that is seen.
bool Tracker::rejects_motion_prior(optimize::PoseProblem problem, const optimize::PoseSummary& held,
                                   const Rigid3& predicted, Rigid3& pose) const {
  constexpr double kGain =
      4.0;  // of the cost: 1 at most where the model was right, soon above 8 where it was not
  problem.prior = motion_prior(held.information, predicted, Motion::kUnknown);
  if (problem.prior) return false;
  optimize::PoseSolverOptions solver = options_.solver;
  solver.max_iterations = 8;
  const optimize::PoseSummary freed = optimize::solve_pose(problem, pose, solver);
  if (freed.initial_cost - freed.final_cost < kGain) return false;
  pose = freed.camera_from_world;
  return true;
}

/// Every direction must be held by families that can be trusted: a handful of chance matches would otherwise
/// hold what a wall leaves free.
void Tracker::judge(optimize::PoseProblem problem, TrackResult& result) const {
  const optimize::PoseSummary& estimate = result.estimate;
  result.surface_share = result.surface_in_view > 0
                             ? static_cast<double>(estimate.planes.inliers) / result.surface_in_view
                             : 0.0;
  const bool by_features = estimate.points.inliers + 2 * estimate.lines.inliers >= options_.min_inliers;
  const bool by_surface = estimate.planes.inliers >= options_.min_surface && result.surface_share > 0.5;
  geometry::Matrix6d information = estimate.information;
  if (by_features != by_surface) {
    if (by_features) problem.planes.clear();
    if (by_surface) problem.points.clear();
    if (by_surface) problem.lines.clear();
    optimize::PoseSolverOptions look = options_.solver;
    look.max_iterations = 0;
    information = optimize::solve_pose(problem, result.camera_from_world, look).information;
  }
  const Directions directions = weigh_directions(information);
  result.min_eigenvalue = directions.eigenvalues(0);
  const double weak = weak_below(information, uses_features() && !by_features);
  result.weak_directions = static_cast<int>((directions.eigenvalues.array() < weak).count());
  // Far corners or one wall leave a direction to the motion model. It may hold that for a while, when what is
  // seen is no chance find.
  const bool many = estimate.points.inliers + 2 * estimate.lines.inliers >= 3 * options_.min_inliers &&
                    result.min_eigenvalue >= kBlind;
  // A direction that falls short by a little is no chance find yet, though some of the surface does not fit.
  const bool nearly = result.min_eigenvalue >= kNearlyHeld * weak;
  const bool all_surface = by_surface && result.surface_share > (nearly ? kMostOfTheSurface : kAllTheSurface);
  result.constrained_by_motion = result.weak_directions > 0 && !(by_features && by_surface);
  result.unobserved = result.constrained_by_motion
                          ? weak_projection(directions, weak)
                          : weak_projection(weigh_directions(estimate.information), kNoisy);
  const bool dead_reckons = last_.valid && lost_frames_ == 0 && dead_reckoning_s_ < kLongestDeadReckoning_s &&
                            ((by_features && many) || all_surface);
  const bool held = result.constrained_by_motion ? dead_reckons : by_features || by_surface;
  result.state =
      held && result.camera_from_world.translation.allFinite() ? TrackState::kTracked : TrackState::kLost;
}

/// Places can look alike: what only the small picture suggested must be confirmed by every family that is in
/// use and has something to say there.
bool Tracker::strict(const TrackResult& result) const {
  constexpr double kMostOfTheFeatures = 0.4;  // of the landmarks that should be seen
  if (result.weak_directions > 0) return false;
  if (options_.depth &&
      (result.estimate.planes.inliers < options_.min_surface || result.surface_share < kMostOfTheSurface)) {
    return false;
  }
  if (!options_.points && !options_.lines) return true;
  const auto found = static_cast<double>(result.points.size() + 2 * result.lines.size());
  const auto expected = static_cast<double>(result.visible_points.size() + 2 * result.visible_lines.size());
  return found >= options_.min_inliers && found >= kMostOfTheFeatures * expected;
}

}  // namespace plumbline::tracking
