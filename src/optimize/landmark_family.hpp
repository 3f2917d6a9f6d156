// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// All landmarks of one kind (points: 3 unknowns, lines: 4) at one linearisation, and their elimination from
// the normal equations (Schur complement). Poses are slots: free ones first, in the order of elimination,
// then fixed ones. Observations are in the order of their poses.
#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "plumbline/geometry/rigid3.hpp"

namespace plumbline::optimize {

/// J^T J of parameters: what damping adds to it, and its scale. Like Ceres: Marquardt's diagonal, of a
/// Jacobian whose columns have been scaled once, by their initial norms.
template <int kUnknowns>
struct Damping {
  using Vector = Eigen::Matrix<double, kUnknowns, 1>;
  Vector scale_sq = Vector::Ones();
  Vector diagonal = Vector::Zero();  ///< clamped; divided by the trust region's radius

  void set_scale(const Vector& of) { scale_sq = (1.0 + of.array().sqrt()).square().inverse(); }
  void set_diagonal(const Vector& of) {
    diagonal = (of.array() * scale_sq.array()).max(1e-6).min(1e32) / scale_sq.array();
  }
};

template <int kUnknowns>
struct LandmarkFamily {
  using Vector = Eigen::Matrix<double, kUnknowns, 1>;
  using Square = Eigen::Matrix<double, kUnknowns, kUnknowns>;
  using Cross = Eigen::Matrix<double, 6, kUnknowns>;

  struct Observation {
    int slot;
    int landmark;
  };
  std::vector<Observation> observations;
  std::vector<std::size_t> slot_begin;      ///< of each slot, into observations
  std::vector<std::size_t> landmark_begin;  ///< of each landmark, into by_landmark
  std::vector<int> by_landmark;             ///< observations of each landmark, in the order of their slots

  std::vector<Cross> cross;       ///< of each observation: J_pose^T J_landmark
  std::vector<Square> square;     ///< J_landmark^T J_landmark
  std::vector<Vector> gradients;  ///< J_landmark^T r

  std::vector<Damping<kUnknowns>> damping;  ///< of each landmark
  std::vector<Square> hessian;
  std::vector<Vector> gradient;
  std::vector<Square> inverse;  ///< of the damped Hessian
  std::vector<Vector> step;     ///< of the landmark alone, minus; then the step itself

  /// `observations` must be set; allocates the rest.
  void prepare(std::size_t slots, std::size_t landmarks) {
    slot_begin.assign(slots + 1, 0);
    landmark_begin.assign(landmarks + 1, 0);
    for (const Observation& s : observations) {
      ++slot_begin[static_cast<std::size_t>(s.slot) + 1];
      ++landmark_begin[static_cast<std::size_t>(s.landmark) + 1];
    }

    // Counting sort of the observations by landmark
    for (std::size_t i = 1; i <= slots; ++i) slot_begin[i] += slot_begin[i - 1];
    for (std::size_t i = 1; i <= landmarks; ++i) landmark_begin[i] += landmark_begin[i - 1];
    std::vector<std::size_t> next(landmark_begin.begin(), landmark_begin.end() - 1);
    by_landmark.resize(observations.size());
    for (std::size_t i = 0; i < observations.size(); ++i) {
      by_landmark[next[static_cast<std::size_t>(observations[i].landmark)]++] = static_cast<int>(i);
    }

    // Memory for a linearisation
    cross.resize(observations.size());
    square.resize(observations.size());
    gradients.resize(observations.size());
    damping.resize(landmarks);
    hessian.resize(landmarks);
    gradient.resize(landmarks);
    inverse.resize(landmarks);
    step.resize(landmarks);
  }

  // Adds up the observations of each landmark.
  void sum() {
    for (std::size_t n = 0; n < hessian.size(); ++n) {
      hessian[n].setZero();
      gradient[n].setZero();
      for (std::size_t i = landmark_begin[n]; i < landmark_begin[n + 1]; ++i) {
        hessian[n] += square[static_cast<std::size_t>(by_landmark[i])];
        gradient[n] += gradients[static_cast<std::size_t>(by_landmark[i])];
      }
    }
  }

  void set_scales() {
    for (std::size_t n = 0; n < hessian.size(); ++n) damping[n].set_scale(hessian[n].diagonal());
  }
  void set_damping() {
    for (std::size_t n = 0; n < hessian.size(); ++n) damping[n].set_diagonal(hessian[n].diagonal());
  }

  /// Inverts each landmark's block; along directions that its poses do not constrain the inverse is zero.
  void invert(double radius) {
    for (std::size_t n = 0; n < hessian.size(); ++n) {
      Square h = hessian[n];
      h.diagonal() += damping[n].diagonal / radius;
      const Eigen::LLT<Square> llt(h);
      if (llt.info() == Eigen::Success) {
        inverse[n] = llt.solve(Square::Identity());
      } else {
        inverse[n] = h.completeOrthogonalDecomposition().pseudoInverse();
      }
      step[n].noalias() = inverse[n] * gradient[n];
    }
  }

  /// Inverts each landmark's block without damping. If a direction has less than this share of the
  /// information of the best one, in units that make the parameters alike, the inverse is zero along it.
  void invert_held(double least_share) {
    invert(std::numeric_limits<double>::infinity());
    for (std::size_t n = 0; n < hessian.size(); ++n) {
      const Vector unit =
          (hessian[n].diagonal().array() > 0.0).select(hessian[n].diagonal().array().sqrt().inverse(), 1.0);
      const Eigen::SelfAdjointEigenSolver<Square> eigen(unit.asDiagonal() * hessian[n] * unit.asDiagonal());
      const double least = least_share * eigen.eigenvalues()(kUnknowns - 1);
      if (eigen.eigenvalues()(0) > least) continue;

      inverse[n].setZero();
      for (int i = 0; i < kUnknowns; ++i) {
        if (!(eigen.eigenvalues()(i) > least)) continue;
        const Vector direction = unit.asDiagonal() * eigen.eigenvectors().col(i);
        inverse[n] += direction * direction.transpose() / eigen.eigenvalues()(i);
      }
      step[n].noalias() = inverse[n] * gradient[n];
    }
  }

  /// The landmarks' steps, once those of the poses (by slot; 6 each) are known.
  void substitute_back(const Eigen::VectorXd& pose_steps) {
    const auto free_slots = static_cast<int>(pose_steps.size() / 6);
    for (std::size_t n = 0; n < hessian.size(); ++n) {
      Vector pull = Vector::Zero();
      for (std::size_t i = landmark_begin[n]; i < landmark_begin[n + 1]; ++i) {
        const auto seen = static_cast<std::size_t>(by_landmark[i]);
        if (observations[seen].slot >= free_slots) break;
        pull.noalias() += cross[seen].transpose() * pose_steps.segment<6>(6 * observations[seen].slot);
      }
      step[n] = -(step[n] + inverse[n] * pull);
    }
  }
};

}  // namespace plumbline::optimize
