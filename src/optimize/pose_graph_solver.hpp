// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Least squares on a pose graph whose edges may be weighed anew between solves: Levenberg-Marquardt with the
// normal equations as blocks of 6x6 (K. Madsen, H. B. Nielsen, O. Tingleff, Methods for Non-linear Least
// Squares Problems, 2004; damping as Ceres has it).
#include <memory>
#include <string>
#include <vector>

#include "block_cholesky.hpp"
#include "bundle_terms.hpp"
#include "plumbline/optimize/pose_graph.hpp"

namespace plumbline::optimize {

class PoseGraphSolver {
 public:
  /// Every pose that is not fixed is held to where it is by 30 m and 30 rad: nothing beside a measurement,
  /// but enough for directions that no edge holds. `executor` may be null.
  PoseGraphSolver(const PoseGraph& graph, const core::Executor* executor);

  void set_weight(std::size_t edge, double weight) { terms_[edge].weight = weight; }

  struct Outcome {
    bool usable = false;
    int iterations = 0;
    std::string message;
  };
  /// From where the poses are. Ends where an iteration lowers the cost by a smaller share than `tolerance`.
  Outcome solve(int max_iterations, double tolerance);

  /// Squared error of an edge as the poses are now, without its weight.
  [[nodiscard]] double chi2(std::size_t edge) const { return chi2(terms_[edge], poses_); }
  [[nodiscard]] const geometry::Rigid3& pose(std::size_t i) const { return poses_[i]; }

 private:
  using Poses = std::vector<geometry::Rigid3>;
  struct Term {
    Term(int of_a, int of_b, const geometry::Rigid3& b_from_a, const geometry::Matrix6d& of_information);
    int a;  ///< pose; -1: the world
    int b;
    EdgeView view;  ///< unweighted
    geometry::Matrix6d information;
    double weight = 1.0;
    double* off_diagonal = nullptr;  ///< block of the two, if both are free
    bool a_first = false;            ///< its row is a's
    geometry::Matrix6d h_aa, h_ab, h_bb;
    geometry::Vector6d g_a, g_b;
  };
  [[nodiscard]] double chi2(const Term& term, const Poses& poses) const;
  [[nodiscard]] double cost(const Poses& poses);
  void make_matrix();
  void linearise(Term& term) const;
  double linearise();
  [[nodiscard]] bool set_step(double radius);
  [[nodiscard]] double expected_decrease(double radius) const;
  [[nodiscard]] Poses moved() const;
  [[nodiscard]] int place(int pose) const { return pose < 0 ? -1 : places_[static_cast<std::size_t>(pose)]; }
  template <typename Body>
  void each_term(const Body& body);

  core::Crew crew_;
  Poses poses_;
  std::vector<Term> terms_;  ///< the edges, then what holds the poses
  std::vector<int> places_;  ///< in the matrix, of each pose; -1: fixed
  std::unique_ptr<BlockCholesky> matrix_;
  std::vector<double> costs_;     ///< of each term
  std::vector<double> gradient_;  ///< by place
  std::vector<double> diagonal_;  ///< of the normal equations
  std::vector<double> step_;
  double radius_;  ///< of trust
};

}  // namespace plumbline::optimize
