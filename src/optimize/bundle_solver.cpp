// SPDX-License-Identifier: BSD-3-Clause
#include "bundle_solver.hpp"

#include <limits>

#include "bundle_round.hpp"
#include "plumbline/core/clones.hpp"

namespace plumbline::optimize {
namespace {

using geometry::Matrix6d;
using geometry::Rigid3;
using geometry::Vector6d;

/// y w^T is subtracted from each target, column-major 6x6; y and w are 6 x unknowns.
PLUMBLINE_CLONES
void subtract_products(const double* y, int unknowns, const Target* targets, std::size_t count) {
  for (std::size_t n = 0; n < count; ++n) {
    double* block = targets[n].block;
    const double* w = targets[n].w;
    for (int j = 0; j < 6; ++j) {
      double sum[6];
      for (int i = 0; i < 6; ++i) sum[i] = block[6 * j + i];
      for (int k = 0; k < unknowns; ++k) {
        const double factor = w[6 * k + j];
        for (int i = 0; i < 6; ++i) sum[i] -= y[6 * k + i] * factor;
      }
      for (int i = 0; i < 6; ++i) block[6 * j + i] = sum[i];
    }
  }
}

}  // namespace

template <typename Family>
void BundleRound::eliminate(const Family& family, std::size_t slot, const std::vector<std::size_t>& block_of,
                            std::vector<Target>& targets, double* rhs) {
  Eigen::Map<Vector6d> b(rhs);
  for (std::size_t i = family.slot_begin[slot]; i < family.slot_begin[slot + 1]; ++i) {
    const auto landmark = at(family.sightings[i].landmark);
    const typename Family::Cross y = family.cross[i] * family.inverse[landmark];
    b.noalias() += family.cross[i] * family.step[landmark];
    targets.clear();
    for (std::size_t k = family.landmark_begin[landmark]; k < family.landmark_begin[landmark + 1]; ++k) {
      const auto other = at(family.by_landmark[k]);
      const auto column = at(family.sightings[other].slot);
      if (column > slot) break;
      double* block =
          column == slot ? matrix_->diagonal(static_cast<int>(slot)) : matrix_->block(block_of[column]);
      targets.push_back({block, family.cross[other].data()});
    }
    subtract_products(y.data(), static_cast<int>(Family::Vector::RowsAtCompileTime), targets.data(),
                      targets.size());
  }
}

/// The row of the reduced equations that belongs to a free slot.
void BundleRound::assemble_row(std::size_t slot, double radius) {
  const int row = static_cast<int>(slot);
  thread_local std::vector<std::size_t> block_of;  // of each column that the row has a block in
  thread_local std::vector<Target> targets;
  block_of.resize(std::max(block_of.size(), slot + 1));
  for (const auto* entry = matrix_->row_begin(row); entry != matrix_->row_end(row); ++entry) {
    block_of[at(entry->column)] = entry->block;
  }
  Eigen::Map<Matrix6d> diagonal(matrix_->diagonal(row));
  diagonal = normal_[slot];
  diagonal.diagonal() += damping_[slot].diagonal / radius;
  double* rhs = pose_steps_.data() + 6 * slot;
  Eigen::Map<Vector6d> start(rhs);
  start = -gradient_[slot];
  eliminate(points_, slot, block_of, targets, rhs);
  eliminate(lines_, slot, block_of, targets, rhs);
}

void BundleRound::assemble_edges() {
  for (const Edge& edge : edges_) {
    if (edge.a < 0 || edge.a >= free_ || edge.b >= free_ || edge.a == edge.b) continue;
    if (edge.a > edge.b) {
      Eigen::Map<Matrix6d>(matrix_->block(edge.a, edge.b)).noalias() += edge.j.by_a.transpose() * edge.j.by_b;
    } else {
      Eigen::Map<Matrix6d>(matrix_->block(edge.b, edge.a)).noalias() += edge.j.by_b.transpose() * edge.j.by_a;
    }
  }
}

/// The step of all unknowns at this radius; false when the equations cannot be solved.
bool BundleRound::solve(double radius) {
  each(points_.hessian.size(), 512, [&](std::size_t i) { points_.invert(i, radius); });
  each(lines_.hessian.size(), 512, [&](std::size_t i) { lines_.invert(i, radius); });
  matrix_->set_zero();
  each(at(free_), 4, [&](std::size_t slot) { assemble_row(slot, radius); });
  assemble_edges();
  if (!matrix_->factor()) return false;
  matrix_->solve(pose_steps_.data());
  for (const double s : pose_steps_) {
    if (!std::isfinite(s)) return false;
  }
  each(points_.hessian.size(), 512,
       [&](std::size_t i) { points_.substitute_back(i, pose_steps_.data(), free_); });
  each(lines_.hessian.size(), 512,
       [&](std::size_t i) { lines_.substitute_back(i, pose_steps_.data(), free_); });
  return true;
}

/// By how much the linearised cost falls: -g.d / 2 + d.D d / 2, since (H + D) d = -g.
double BundleRound::model_decrease(double radius) const {
  double gradient = 0.0;
  double damped = 0.0;
  for (std::size_t i = 0; i < normal_.size(); ++i) {
    const Eigen::Map<const Vector6d> d(pose_steps_.data() + 6 * i);
    gradient += gradient_[i].dot(d);
    damped += damping_[i].diagonal.dot(d.cwiseAbs2());
  }
  const auto add = [&](const auto& family) {
    for (std::size_t i = 0; i < family.hessian.size(); ++i) {
      gradient += family.gradient[i].dot(family.step[i]);
      damped += family.damping[i].diagonal.dot(family.step[i].cwiseAbs2());
    }
  };
  add(points_);
  add(lines_);
  return 0.5 * (damped / radius - gradient);
}

void BundleRound::step(const BundleState& from, BundleState& to) const {
  for (std::size_t i = 0; i < at(free_); ++i) {
    const Eigen::Map<const Vector6d> d(pose_steps_.data() + 6 * i);
    const auto pose = at(slot_pose_[i]);
    to.poses[pose] = geometry::exp_se3(d) * from.poses[pose];
  }
  for (std::size_t i = 0; i < points_.step.size(); ++i) {
    if (points_.landmark_begin[i] < points_.landmark_begin[i + 1])
      to.points[i] = from.points[i] + points_.step[i];
  }
  for (std::size_t i = 0; i < lines_.step.size(); ++i) {
    if (lines_.landmark_begin[i] == lines_.landmark_begin[i + 1]) continue;
    to.lines[i] = geometry::update(from.lines[i], lines_.step[i]);
    to.lines[i].u = Eigen::Quaterniond(to.lines[i].u).normalized().toRotationMatrix();
  }
}

/// Nothing moves by more than rounding does.
bool BundleRound::tiny_step(const BundleState& state) const {
  constexpr double kShare = 1e-7;
  double moved = 0.0;
  for (const double s : pose_steps_) moved += s * s;
  for (const Eigen::Vector3d& s : points_.step) moved += s.squaredNorm();
  for (const Eigen::Vector4d& s : lines_.step) moved += s.squaredNorm();
  double size = static_cast<double>(state.poses.size() + 2 * state.lines.size());
  for (const Rigid3& pose : state.poses) size += pose.translation.squaredNorm();
  for (const Eigen::Vector3d& p : state.points) size += p.squaredNorm();
  return std::sqrt(moved) <= kShare * (std::sqrt(size) + kShare);
}

RoundSummary BundleRound::run(BundleState& state) {
  constexpr double kGradientTolerance = 1e-10;
  constexpr double kLeastGain = 1e-3;  // share of what was promised that a step must bring
  constexpr double kLargestRadius = 1e16;
  constexpr double kSmallestRadius = 1e-32;
  RoundSummary summary;
  double radius = options_.first_radius;
  double shrink = 2.0;
  double now = linearise(state);
  summary.initial_cost = summary.final_cost = now;
  summary.iterations = 1;
  if (!std::isfinite(now)) {
    summary.message = "the cost is not a number: an observation or a pose is none";
    return summary;
  }
  summary.usable = true;
  summary.message = "as many iterations as allowed";
  set_scales();
  set_damping();
  BundleState next = state;
  for (int iteration = 0; iteration < options_.max_iterations; ++iteration) {
    if (largest_gradient() <= kGradientTolerance) {
      summary.message = "the gradient is zero";
      break;
    }
    if (radius < kSmallestRadius) {
      summary.message = "no step lowers the cost";
      break;
    }
    ++summary.iterations;
    const double promised = solve(radius) ? model_decrease(radius) : 0.0;
    double then = std::numeric_limits<double>::infinity();
    if (promised > 0.0) {
      step(state, next);
      then = cost(next);
      if (tiny_step(state)) {
        summary.message = "the step is zero";
        break;
      }
    }
    const bool settled = std::abs(now - then) <= options_.tolerance * now;
    const double gain = promised > 0.0 ? (now - then) / promised : -1.0;
    if (!(gain > kLeastGain)) {
      if (settled) {
        summary.message = "the cost falls no more";
        break;
      }
      radius /= shrink;
      shrink *= 2.0;
      continue;
    }
    std::swap(state, next);
    now = settled ? then : linearise(state);
    summary.final_cost = now;
    if (settled) {
      summary.message = "the cost falls no more";
      break;
    }
    set_damping();
    const double quality = 2.0 * gain - 1.0;
    radius = std::min(kLargestRadius, radius / std::max(1.0 / 3.0, 1.0 - quality * quality * quality));
    shrink = 2.0;
  }
  return summary;
}

RoundSummary solve_bundle_round(const BundleProblem& problem, const BundleOptions& options, core::Crew& crew,
                                BundleState& state) {
  return BundleRound(problem, options, crew, state).run(state);
}

}  // namespace plumbline::optimize
