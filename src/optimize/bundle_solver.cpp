// SPDX-License-Identifier: BSD-3-Clause
#include "bundle_solver.hpp"

#include <limits>

#include "bundle_round.hpp"

namespace plumbline::optimize {

using geometry::Matrix6d;
using geometry::Rigid3;
using geometry::Vector6d;

void TrustRegion::accept(double gain) {
  constexpr double kLargest = 1e16;
  const double quality = 2.0 * gain - 1.0;
  radius_ = std::min(kLargest, radius_ / std::max(1.0 / 3.0, 1.0 - quality * quality * quality));
  shrink_ = 2.0;
}

void TrustRegion::reject() {
  radius_ /= shrink_;
  shrink_ *= 2.0;
}

/// Decrease of the linearised cost: -g.d / 2 + d.D d / 2, since (H + D) d = -g.
double BundleRound::model_decrease(double radius) const {
  double gradient = 0.0;
  double damped = 0.0;
  for (std::size_t i = 0; i < equations_.hessian.size(); ++i) {
    const Vector6d d = reduced_.pose_step(i);
    gradient += equations_.gradient[i].dot(d);
    damped += equations_.damping[i].diagonal.dot(d.cwiseAbs2());
  }
  const auto add = [&](const auto& family) {
    for (std::size_t i = 0; i < family.hessian.size(); ++i) {
      gradient += family.gradient[i].dot(family.step[i]);
      damped += family.damping[i].diagonal.dot(family.step[i].cwiseAbs2());
    }
  };
  add(equations_.points);
  add(equations_.lines);
  return 0.5 * (damped / radius - gradient);
}

void BundleRound::step(const BundleState& from, BundleState& to) const {
  for (int i = 0; i < slots_.free; ++i) {
    const auto pose = at(slots_.pose[at(i)]);
    to.poses[pose] = geometry::exp_se3(reduced_.pose_step(at(i))) * from.poses[pose];
  }

  // Landmarks without observations stay
  for (std::size_t i = 0; i < equations_.points.step.size(); ++i) {
    if (equations_.points.landmark_begin[i] < equations_.points.landmark_begin[i + 1])
      to.points[i] = from.points[i] + equations_.points.step[i];
  }
  for (std::size_t i = 0; i < equations_.lines.step.size(); ++i) {
    if (equations_.lines.landmark_begin[i] == equations_.lines.landmark_begin[i + 1]) continue;
    to.lines[i] = geometry::update(from.lines[i], equations_.lines.step[i]);

    // Rounding must not accumulate in the rotation
    to.lines[i].u = Eigen::Quaterniond(to.lines[i].u).normalized().toRotationMatrix();
  }
}

/// True if the step is no larger than rounding errors.
bool BundleRound::tiny_step(const BundleState& state) const {
  constexpr double kShare = 1e-7;
  double moved = reduced_.squared_pose_steps();
  for (const Eigen::Vector3d& s : equations_.points.step) moved += s.squaredNorm();
  for (const Eigen::Vector4d& s : equations_.lines.step) moved += s.squaredNorm();
  double size = static_cast<double>(state.poses.size() + 2 * state.lines.size());
  for (const Rigid3& pose : state.poses) size += pose.translation.squaredNorm();
  for (const Eigen::Vector3d& p : state.points) size += p.squaredNorm();
  return std::sqrt(moved) <= kShare * (std::sqrt(size) + kShare);
}

/// Makes one step; returns the reason if it was the last one, else null.
const char* BundleRound::iterate(TrustRegion& region, BundleState& state, BundleState& next,
                                 RoundSummary& summary) {
  constexpr double kGradientTolerance = 1e-10;
  constexpr double kLeastGain = 1e-3;  // smallest gain of a step, relative to its predicted gain
  if (equations_.largest_gradient() <= kGradientTolerance) return "the gradient is zero";
  if (region.exhausted()) return "no step lowers the cost";

  // The step and its cost
  ++summary.iterations;
  const double now = summary.final_cost;
  const double promised = reduced_.solve(equations_, region.radius()) ? model_decrease(region.radius()) : 0.0;
  double then = std::numeric_limits<double>::infinity();
  if (promised > 0.0) {
    step(state, next);
    then = cost(next);
    if (tiny_step(state)) return "the step is zero";
  }

  // Accepted if a share of the predicted gain is real
  const bool settled = std::abs(now - then) <= options_.tolerance * now;
  const double gain = promised > 0.0 ? (now - then) / promised : -1.0;
  if (gain > kLeastGain) {
    std::swap(state, next);
    summary.final_cost = settled ? then : linearise(state);
  }
  if (settled) return "the cost falls no more";

  // The trust region follows the gain
  if (gain > kLeastGain) {
    equations_.set_damping();
    region.accept(gain);
  } else {
    region.reject();
  }

  return nullptr;
}

RoundSummary BundleRound::run(BundleState& state) {
  RoundSummary summary;
  summary.initial_cost = summary.final_cost = linearise(state);
  summary.iterations = 1;
  if (!std::isfinite(summary.initial_cost)) {
    summary.message = "the cost is not a number, because an observation or a pose is not";
    return summary;
  }
  summary.usable = true;

  // Levenberg-Marquardt, with scales from the first equations
  equations_.set_scales();
  equations_.set_damping();
  TrustRegion region(options_.first_radius);
  BundleState next = state;
  const char* ended = nullptr;
  for (int i = 0; i < options_.max_iterations && ended == nullptr; ++i)
    ended = iterate(region, state, next, summary);
  summary.message = ended != nullptr ? ended : "as many iterations as allowed";
  return summary;
}

RoundSummary solve_bundle_round(const BundleProblem& problem, const BundleOptions& options,
                                BundleState& state) {
  BundleRound round(problem, options);
  round.hold(state);
  return round.run(state);
}

}  // namespace plumbline::optimize
