// SPDX-License-Identifier: BSD-3-Clause
#include "bundle_solver.hpp"

#include <limits>

#include "bundle_round.hpp"
#include "plumbline/core/clones.hpp"
#include "plumbline/optimize/pose_covariances.hpp"

namespace plumbline::optimize {
namespace {

using geometry::Matrix6d;
using geometry::Rigid3;
using geometry::Vector6d;

/// y w^T is subtracted from each target, a 6x6 block of a matrix whose columns are `stride` long; y and w are
/// 6 x unknowns.
PLUMBLINE_CLONES
void subtract_products(const double* y, int unknowns, const std::vector<Target>& targets,
                       std::ptrdiff_t stride) {
  for (const Target& target : targets) {
    const double* w = target.w;
    for (int j = 0; j < 6; ++j) {
      double* column = target.block + stride * j;
      double sum[6];
      for (int i = 0; i < 6; ++i) sum[i] = column[i];
      for (int k = 0; k < unknowns; ++k) {
        const double factor = w[6 * k + j];
        for (int i = 0; i < 6; ++i) sum[i] -= y[6 * k + i] * factor;
      }
      for (int i = 0; i < 6; ++i) column[i] = sum[i];
    }
  }
}

}  // namespace

/// Takes the landmarks that a free slot sees out of its row of the equations.
template <typename Family>
void BundleRound::eliminate(const Family& family, std::size_t slot) {
  const int row = static_cast<int>(slot);
  for (std::size_t i = family.slot_begin[slot]; i < family.slot_begin[slot + 1]; ++i) {
    const auto landmark = at(family.observations[i].landmark);
    const typename Family::Cross y = family.cross[i] * family.inverse[landmark];
    pose_steps_.segment<6>(6 * row).noalias() += family.cross[i] * family.step[landmark];
    targets_.clear();
    for (std::size_t k = family.landmark_begin[landmark]; k < family.landmark_begin[landmark + 1]; ++k) {
      const auto other = at(family.by_landmark[k]);
      const int column = family.observations[other].slot;
      if (column > row) break;
      targets_.push_back({block(row, column), family.cross[other].data()});
    }
    subtract_products(y.data(), static_cast<int>(Family::Vector::RowsAtCompileTime), targets_,
                      matrix_.rows());
  }
}

/// The reduced equations; their right side is put where the steps will be.
void BundleRound::assemble(double radius) {
  matrix_.setZero();
  for (std::size_t slot = 0; slot < at(free_); ++slot) {
    const auto begin = static_cast<Eigen::Index>(6 * slot);
    matrix_.block<6, 6>(begin, begin) = normal_[slot];
    matrix_.diagonal().segment<6>(begin) += damping_[slot].diagonal / radius;
    pose_steps_.segment<6>(begin) = -gradient_[slot];
    eliminate(points_, slot);
    eliminate(lines_, slot);
  }
  for (const Edge& edge : edges_) {
    if (edge.a < 0 || edge.a >= free_ || edge.b >= free_ || edge.a == edge.b) continue;
    const Matrix6d cross = edge.j.by_a.transpose() * edge.j.by_b;
    if (edge.a > edge.b) {
      matrix_.block<6, 6>(6 * edge.a, 6 * edge.b) += cross;
    } else {
      matrix_.block<6, 6>(6 * edge.b, 6 * edge.a) += cross.transpose();
    }
  }
}

/// The step of all unknowns at this radius; false when the equations cannot be solved.
bool BundleRound::solve(double radius) {
  points_.invert(radius);
  lines_.invert(radius);
  assemble(radius);
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> llt(matrix_);
  if (llt.info() != Eigen::Success) return false;
  llt.solveInPlace(pose_steps_);
  if (!pose_steps_.allFinite()) return false;
  points_.substitute_back(pose_steps_);
  lines_.substitute_back(pose_steps_);
  return true;
}

/// By how much the linearised cost falls: -g.d / 2 + d.D d / 2, since (H + D) d = -g.
double BundleRound::model_decrease(double radius) const {
  double gradient = 0.0;
  double damped = 0.0;
  for (std::size_t i = 0; i < normal_.size(); ++i) {
    const Vector6d d = pose_steps_.segment<6>(static_cast<Eigen::Index>(6 * i));
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
  for (int i = 0; i < free_; ++i) {
    const auto pose = at(slot_pose_[at(i)]);
    to.poses[pose] = geometry::exp_se3(pose_steps_.segment<6>(6 * i)) * from.poses[pose];
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
  double moved = pose_steps_.squaredNorm();
  for (const Eigen::Vector3d& s : points_.step) moved += s.squaredNorm();
  for (const Eigen::Vector4d& s : lines_.step) moved += s.squaredNorm();
  double size = static_cast<double>(state.poses.size() + 2 * state.lines.size());
  for (const Rigid3& pose : state.poses) size += pose.translation.squaredNorm();
  for (const Eigen::Vector3d& p : state.points) size += p.squaredNorm();
  return std::sqrt(moved) <= kShare * (std::sqrt(size) + kShare);
}

/// Diagonal blocks of the reduced equations' inverse: with S = L L^T they are X^T X, L X = the pose's columns
/// of the identity, of which only rows from the pose on are not zero. Several poses at a time, as each asks
/// for all of L.
std::vector<Matrix6d> BundleRound::covariances(const BundleState& state) {
  constexpr double kUndamped = std::numeric_limits<double>::infinity();
  constexpr int kAtATime = 16;
  linearise(state);
  points_.invert(kUndamped);
  lines_.invert(kUndamped);
  assemble(kUndamped);
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> llt(matrix_);
  if (llt.info() != Eigen::Success) return {};
  std::vector<Matrix6d> result(state.poses.size(), Matrix6d::Zero());
  for (int first = 0; first < free_; first += kAtATime) {
    const Eigen::Index rows = matrix_.rows() - 6 * first;
    const int end = std::min(free_, first + kAtATime);
    Eigen::MatrixXd x = Eigen::MatrixXd::Identity(rows, 6 * (end - first));
    matrix_.bottomRightCorner(rows, rows).triangularView<Eigen::Lower>().solveInPlace(x);
    for (int slot = first; slot < end; ++slot) {
      const auto columns = x.middleCols<6>(6 * (slot - first));
      result[at(slot_pose_[at(slot)])].noalias() = columns.transpose() * columns;
    }
  }
  return result;
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

RoundSummary solve_bundle_round(const BundleProblem& problem, const BundleOptions& options,
                                BundleState& state) {
  BundleRound round(problem, options);
  round.hold(state);
  return round.run(state);
}

std::vector<Matrix6d> pose_covariances(const BundleProblem& problem, const BundleOptions& options) {
  return BundleRound(problem, options).covariances(state_of(problem));
}

}  // namespace plumbline::optimize
