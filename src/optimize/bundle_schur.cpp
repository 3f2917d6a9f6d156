// SPDX-License-Identifier: BSD-3-Clause
#include "bundle_round.hpp"
#include "plumbline/core/clones.hpp"

namespace plumbline::optimize {
namespace {

using geometry::Matrix6d;

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

/// Eliminates the landmarks that a free slot sees from its row of the equations.
template <typename Family>
void SchurComplement::eliminate(const Family& family, std::size_t slot) {
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
    subtract_products(y.data(), static_cast<int>(Family::Vector::RowsAtCompileTime), targets_, stride());
  }
}

SchurComplement::SchurComplement(int free_poses) : free_(free_poses), pose_steps_(6 * free_poses) {
  if (free_poses > kMostDense) {
    sparse_.emplace(free_poses);
  } else {
    matrix_.resize(6 * free_poses, 6 * free_poses);
  }
}

/// Landmarks must be inverted. The right side is stored in the place of the steps.
void SchurComplement::assemble(NormalEquations& equations, double radius) {
  if (sparse_) {
    sparse_->clear();
  } else {
    matrix_.setZero();
  }

  // Equations of the poses, with landmarks eliminated
  for (std::size_t slot = 0; slot < at(free_); ++slot) {
    auto own = entries(static_cast<int>(slot), static_cast<int>(slot));
    own = equations.hessian[slot];
    own.diagonal() += equations.damping[slot].diagonal / radius;
    pose_steps_.segment<6>(static_cast<Eigen::Index>(6 * slot)) = -equations.gradient[slot];
    eliminate(equations.points, slot);
    eliminate(equations.lines, slot);
  }

  // Edges couple two free poses
  for (const RoundEdge& edge : equations.edges) {
    if (edge.a < 0 || edge.a >= free_ || edge.b >= free_ || edge.a == edge.b) continue;
    const Matrix6d cross = edge.j.by_a.transpose() * edge.j.by_b;
    if (edge.a > edge.b) {
      entries(edge.a, edge.b) += cross;
    } else {
      entries(edge.b, edge.a) += cross.transpose();
    }
  }
}

bool SchurComplement::solve(NormalEquations& equations, double radius) {
  // Landmarks are eliminated, poses solved, landmarks substituted
  equations.points.invert(radius);
  equations.lines.invert(radius);
  assemble(equations, radius);
  if (sparse_) {
    if (!sparse_->solve(pose_steps_)) return false;
  } else {
    const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> llt(matrix_);
    if (llt.info() != Eigen::Success) return false;
    llt.solveInPlace(pose_steps_);
  }
  if (!pose_steps_.allFinite()) return false;
  equations.points.substitute_back(pose_steps_);
  equations.lines.substitute_back(pose_steps_);
  return true;
}

bool SchurComplement::fits(NormalEquations& equations, std::size_t most) {
  if (!sparse_) return true;
  assemble(equations, 1.0);
  return sparse_->factor_numbers() <= most;
}

/// With S = L L^T they are X^T X, L X = the pose's columns of the identity, of which only rows from the pose
/// on are not zero. Several poses are solved at a time, as each needs all of L.
std::vector<Matrix6d> SchurComplement::inverse_blocks(NormalEquations& equations, double least_share) {
  constexpr int kAtATime = 16;
  equations.points.invert_held(least_share);
  equations.lines.invert_held(least_share);
  assemble(equations, 1.0);
  if (sparse_) return sparse_->inverse_blocks();

  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> llt(matrix_);
  if (llt.info() != Eigen::Success) return {};

  // Columns of several poses at a time
  std::vector<Matrix6d> result(at(free_));
  for (int first = 0; first < free_; first += kAtATime) {
    const Eigen::Index rows = matrix_.rows() - 6 * first;
    const int end = std::min(free_, first + kAtATime);
    Eigen::MatrixXd x = Eigen::MatrixXd::Identity(rows, 6 * (end - first));
    matrix_.bottomRightCorner(rows, rows).triangularView<Eigen::Lower>().solveInPlace(x);
    for (int slot = first; slot < end; ++slot) {
      const auto columns = x.middleCols<6>(6 * (slot - first));
      result[at(slot)].noalias() = columns.transpose() * columns;
    }
  }
  return result;
}

}  // namespace plumbline::optimize
