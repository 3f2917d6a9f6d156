// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Internals of bundle_solver: observations by pose and landmark (bundle_round.cpp), the normal equations
// (bundle_normal.cpp), elimination of landmarks (bundle_schur.cpp), steps (bundle_solver.cpp).
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "bundle_solver.hpp"
#include "bundle_terms.hpp"
#include "landmark_family.hpp"
#include "plumbline/optimize/pose_covariances.hpp"
#include "plumbline/optimize/pose_terms.hpp"
#include "sparse_blocks.hpp"

namespace plumbline::optimize {

inline std::size_t at(int i) { return static_cast<std::size_t>(i); }

/// Cost of a squared error and weight of its term (Huber).
struct Huber {
  double threshold;
  [[nodiscard]] double cost(double squared) const {
    if (squared <= threshold * threshold) return 0.5 * squared;
    return threshold * std::sqrt(squared) - 0.5 * threshold * threshold;
  }
  [[nodiscard]] double weight(double squared) const {
    return squared <= threshold * threshold ? 1.0 : threshold / std::sqrt(squared);
  }
};

/// A block of the matrix from which a product is subtracted, and the product's second factor (6 x unknowns).
struct Target {
  double* block;
  const double* w;
};

/// Region in which the linearisation is trusted: grows with steps that reduce the cost as predicted (Madsen,
/// Nielsen, Tingleff, 2004; as in Ceres).
class TrustRegion {
 public:
  explicit TrustRegion(double radius) : radius_(radius) {}
  [[nodiscard]] double radius() const { return radius_; }
  [[nodiscard]] bool exhausted() const { return radius_ < 1e-32; }
  /// `gain`: actual reduction of the cost, as a share of the predicted one.
  void accept(double gain);
  void reject();

 private:
  double radius_;
  double shrink_ = 2.0;
};

/// Poses in the order in which they are eliminated: free ones first.
struct PoseSlots {
  explicit PoseSlots(const BundleProblem& problem);
  std::vector<int> of_pose;  ///< slot of each pose
  std::vector<int> pose;     ///< pose of each slot
  int free = 0;
};

/// An edge, linearised.
struct RoundEdge {
  int a;  ///< slot; -1: the world
  int b;
  EdgeView view;
  bool robust;
  EdgeDerivatives j{};
  geometry::Vector6d r = geometry::Vector6d::Zero();
};

/// The normal equations of a round: J^T J and J^T r of free poses, and of landmarks with what couples them to
/// poses.
struct NormalEquations {
  std::vector<geometry::Matrix6d> hessian;  ///< of each free slot
  std::vector<geometry::Vector6d> gradient;
  std::vector<Damping<6>> damping;
  LandmarkFamily<3> points;
  LandmarkFamily<4> lines;
  std::vector<RoundEdge> edges;

  void set_scales();
  void set_damping();
  [[nodiscard]] double largest_gradient() const;
};

/// Normal equations of the poses after the landmarks are eliminated. More than kMostDense poses are stored as
/// sparse blocks.
class SchurComplement {
 public:
  explicit SchurComplement(int free_poses);
  /// The step of all unknowns at this radius of the trust region (landmarks: in their families); false if the
  /// equations cannot be solved.
  bool solve(NormalEquations& equations, double radius);
  [[nodiscard]] Eigen::Matrix<double, 6, 1> pose_step(std::size_t slot) const {
    return pose_steps_.segment<6>(static_cast<Eigen::Index>(6 * slot));
  }
  [[nodiscard]] double squared_pose_steps() const { return pose_steps_.squaredNorm(); }
  /// Diagonal blocks of the inverse, with the damping of the poses only, at radius 1: the covariances of free
  /// poses. Empty: singular. `least_share`: see LandmarkFamily::invert_held.
  std::vector<geometry::Matrix6d> inverse_blocks(NormalEquations& equations, double least_share);
  /// True if inverse_blocks() keeps within `most` numbers.
  [[nodiscard]] bool fits(NormalEquations& equations, std::size_t most);

 private:
  static constexpr int kMostDense = 600;
  template <typename Family>
  void eliminate(const Family& family, std::size_t slot);
  void assemble(NormalEquations& equations, double radius);
  [[nodiscard]] double* block(int row, int column) {
    return sparse_ ? sparse_->block(row, column) : &matrix_(6 * row, 6 * column);
  }
  /// Distance between the columns of a block.
  [[nodiscard]] std::ptrdiff_t stride() const { return sparse_ ? 6 : matrix_.rows(); }
  using Entries = Eigen::Map<geometry::Matrix6d, 0, Eigen::OuterStride<>>;
  [[nodiscard]] Entries entries(int row, int column) {
    return Entries(block(row, column), Eigen::OuterStride<>(stride()));
  }

  int free_;
  Eigen::VectorXd pose_steps_;  ///< 6 a free slot
  Eigen::MatrixXd matrix_;      ///< its lower triangle; empty: in sparse_
  std::optional<SparseBlocks> sparse_;
  std::vector<Target> targets_;
};

/// One round: linearises, steps, and keeps steps that lower the cost.
class BundleRound {
 public:
  BundleRound(const BundleProblem& problem, const BundleOptions& options);

  /// Holds poses that have edges at their present positions as well (holding_edges).
  void hold(const BundleState& state);
  RoundSummary run(BundleState& state);
  [[nodiscard]] PoseCovariances covariances(const BundleState& state);

 private:
  void add_observations();
  [[nodiscard]] double cost(const BundleState& state);
  double linearise(const BundleState& state);
  double linearise_slot(std::size_t slot, const BundleState& state);
  double linearise_edge(RoundEdge& edge, const BundleState& state);
  [[nodiscard]] double model_decrease(double radius) const;
  void step(const BundleState& from, BundleState& to) const;
  [[nodiscard]] bool tiny_step(const BundleState& state) const;
  const char* iterate(TrustRegion& region, BundleState& state, BundleState& next, RoundSummary& summary);
  [[nodiscard]] std::vector<geometry::Matrix6d> held_by_prior(double information);
  [[nodiscard]] std::vector<geometry::Matrix6d> repaired();

  const BundleProblem& problem_;
  const BundleOptions& options_;
  Eigen::Matrix3d projection_;
  PoseSlots slots_;
  std::vector<PointTerm> point_terms_;  ///< of each observation
  std::vector<LineView> line_views_;
  NormalEquations equations_;
  SchurComplement reduced_;
};

}  // namespace plumbline::optimize
