// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The inside of bundle_solver: what is seen by whom (bundle_round.cpp), the normal equations
// (bundle_normal.cpp), steps (bundle_solver.cpp).
#include <algorithm>
#include <cmath>
#include <vector>

#include "bundle_solver.hpp"
#include "bundle_terms.hpp"
#include "landmark_family.hpp"
#include "plumbline/optimize/pose_terms.hpp"

namespace plumbline::optimize {

inline std::size_t at(int i) { return static_cast<std::size_t>(i); }

/// What a squared error costs, and what its term weighs (Huber).
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

/// Normal equations of one round, and what it steps through.
class BundleRound {
 public:
  BundleRound(const BundleProblem& problem, const BundleOptions& options);

  /// Poses that edges hold are held where they are as well (holding_edges).
  void hold(const BundleState& state);
  RoundSummary run(BundleState& state);
  [[nodiscard]] std::vector<geometry::Matrix6d> covariances(const BundleState& state);

 private:
  using Matrix6d = geometry::Matrix6d;
  using Vector6d = geometry::Vector6d;
  using Rigid3 = geometry::Rigid3;
  using Points = LandmarkFamily<3>;
  using Lines = LandmarkFamily<4>;
  struct Edge {
    int a;  ///< slot; -1: the world
    int b;
    EdgeView view;
    bool robust;
    EdgeDerivatives j{};
    Vector6d r = Vector6d::Zero();
  };

  void choose_slots();
  void add_observations();
  [[nodiscard]] double cost(const BundleState& state);
  double linearise(const BundleState& state);
  double linearise_slot(std::size_t slot, const BundleState& state);
  double linearise_edge(Edge& edge, const BundleState& state);
  void set_scales();
  void set_damping();
  [[nodiscard]] double largest_gradient() const;
  bool solve(double radius);
  template <typename Family>
  void eliminate(const Family& family, std::size_t slot);
  void assemble(double radius);
  [[nodiscard]] double* block(int row, int column) { return &matrix_(6 * row, 6 * column); }
  [[nodiscard]] double model_decrease(double radius) const;
  void step(const BundleState& from, BundleState& to) const;
  [[nodiscard]] bool tiny_step(const BundleState& state) const;

  const BundleProblem& problem_;
  const BundleOptions& options_;
  Eigen::Matrix3d projection_;
  Huber point_loss_;
  Huber line_loss_;
  Huber edge_loss_;

  std::vector<int> slot_of_;    ///< of each pose
  std::vector<int> slot_pose_;  ///< pose of each slot
  int free_ = 0;
  Points points_;
  Lines lines_;
  std::vector<PointTerm> point_terms_;  ///< of each observation
  std::vector<LineView> line_views_;
  std::vector<Edge> edges_;

  std::vector<Matrix6d> normal_;  ///< of each free slot: J^T J
  std::vector<Vector6d> gradient_;
  std::vector<Damping<6>> damping_;
  Eigen::VectorXd pose_steps_;  ///< 6 a free slot
  Eigen::MatrixXd matrix_;      ///< of the reduced equations: its lower triangle
  std::vector<Target> targets_;
};

}  // namespace plumbline::optimize
