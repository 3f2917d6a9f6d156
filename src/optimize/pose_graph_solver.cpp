// SPDX-License-Identifier: BSD-3-Clause
#include "pose_graph_solver.hpp"

#include <algorithm>
#include <cmath>

namespace plumbline::optimize {
namespace {

using geometry::Matrix6d;
using geometry::Rigid3;
using geometry::Vector6d;

constexpr double kHoldInformation = 1e-3;
constexpr double kFirstRadius = 1e8;  // relative poses are nearly linear: steps are hardly damped
constexpr double kLeastRadius = 1e-12;
constexpr double kMostRadius = 1e16;

std::size_t at(int i) { return static_cast<std::size_t>(i); }

Eigen::Map<Vector6d> six(std::vector<double>& numbers, int place) {
  return Eigen::Map<Vector6d>(numbers.data() + 6 * at(place));
}

}  // namespace

PoseGraphSolver::Term::Term(int of_a, int of_b, const Rigid3& b_from_a, const Matrix6d& of_information)
    : a(of_a),
      b(of_b),
      view(BundleEdge{of_a, of_b, b_from_a, Matrix6d::Identity()}),
      information(of_information) {
  view.root.setIdentity();
}

PoseGraphSolver::PoseGraphSolver(const PoseGraph& graph, const core::Executor* executor)
    : crew_(executor), radius_(kFirstRadius) {
  terms_.reserve(graph.edges.size() + graph.poses.size());
  for (const GraphEdge& edge : graph.edges)
    terms_.emplace_back(edge.a, edge.b, edge.b_from_a, edge.information);
  const Matrix6d hold = kHoldInformation * Matrix6d::Identity();
  for (std::size_t i = 0; i < graph.poses.size(); ++i) {
    const GraphPose& pose = graph.poses[i];
    poses_.push_back(pose.camera_from_world);
    places_.push_back(pose.fixed ? -1 : 0);
    if (!pose.fixed) terms_.emplace_back(-1, static_cast<int>(i), pose.camera_from_world, hold);
  }
  costs_.resize(terms_.size());
  make_matrix();
}

void PoseGraphSolver::make_matrix() {
  int free = 0;
  for (int& place : places_) {
    if (place >= 0) place = free++;
  }
  std::vector<std::pair<int, int>> pairs;
  for (const Term& term : terms_) {
    if (place(term.a) >= 0 && place(term.b) >= 0)
      pairs.emplace_back(std::minmax(place(term.a), place(term.b)));
  }
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  const std::vector<int> order = elimination_places(free, pairs);
  for (int& place : places_) {
    if (place >= 0) place = order[at(place)];
  }
  for (auto& [a, b] : pairs) {
    a = order[at(a)];
    b = order[at(b)];
  }
  matrix_ = std::make_unique<BlockCholesky>(free, pairs, &crew_);
  for (Term& term : terms_) {
    const int a = place(term.a);
    const int b = place(term.b);
    if (a < 0 || b < 0) continue;
    term.a_first = a > b;
    term.off_diagonal = matrix_->block(std::max(a, b), std::min(a, b));
  }
  gradient_.resize(6 * at(free));
  diagonal_.resize(6 * at(free));
  step_.resize(6 * at(free));
}

template <typename Body>
void PoseGraphSolver::each_term(const Body& body) {
  constexpr std::size_t kTogether = 64;
  crew_.each(terms_.size(), kTogether, body);
}

double PoseGraphSolver::chi2(const Term& term, const Poses& poses) const {
  const Vector6d e =
      edge_rows(term.view, term.a < 0 ? Rigid3() : poses[at(term.a)], poses[at(term.b)], nullptr);
  return std::max(0.0, e.dot(term.information * e));
}

double PoseGraphSolver::cost(const Poses& poses) {
  each_term([&](std::size_t i) {
    costs_[i] = terms_[i].weight > 0.0 ? 0.5 * terms_[i].weight * chi2(terms_[i], poses) : 0.0;
  });
  double sum = 0.0;
  for (const double c : costs_) sum += c;
  return sum;
}

void PoseGraphSolver::linearise(Term& term) const {
  EdgeDerivatives j;
  const Vector6d e = edge_rows(term.view, term.a < 0 ? Rigid3() : poses_[at(term.a)], poses_[at(term.b)], &j);
  const Matrix6d information = term.weight * term.information;
  Matrix6d weighted;
  weighted.noalias() = information * j.by_b;
  term.h_bb.noalias() = j.by_b.transpose() * weighted;
  term.g_b.noalias() = weighted.transpose() * e;
  if (place(term.a) < 0) return;
  term.h_ab.noalias() = j.by_a.transpose() * weighted;
  weighted.noalias() = information * j.by_a;
  term.h_aa.noalias() = j.by_a.transpose() * weighted;
  term.g_a.noalias() = weighted.transpose() * e;
}

/// Normal equations at the poses as they are; the largest number of the gradient.
double PoseGraphSolver::linearise() {
  each_term([&](std::size_t i) {
    if (terms_[i].weight > 0.0) linearise(terms_[i]);
  });
  std::fill(gradient_.begin(), gradient_.end(), 0.0);
  std::fill(diagonal_.begin(), diagonal_.end(), 0.0);
  for (const Term& term : terms_) {
    if (!(term.weight > 0.0)) continue;
    if (const int b = place(term.b); b >= 0) {
      six(gradient_, b) += term.g_b;
      six(diagonal_, b) += term.h_bb.diagonal();
    }
    if (const int a = place(term.a); a >= 0) {
      six(gradient_, a) += term.g_a;
      six(diagonal_, a) += term.h_aa.diagonal();
    }
  }
  double largest = 0.0;
  for (const double g : gradient_) largest = std::max(largest, std::abs(g));
  return largest;
}

/// The step of all poses; false: the equations cannot be solved.
bool PoseGraphSolver::set_step(double radius) {
  matrix_->set_zero();
  const auto block = [](double* numbers) { return Eigen::Map<Matrix6d>(numbers); };
  for (const Term& term : terms_) {
    if (!(term.weight > 0.0)) continue;
    const int a = place(term.a);
    const int b = place(term.b);
    if (b >= 0) block(matrix_->diagonal(b)) += term.h_bb;
    if (a >= 0) block(matrix_->diagonal(a)) += term.h_aa;
    if (term.off_diagonal == nullptr) continue;
    if (term.a_first) {
      block(term.off_diagonal) += term.h_ab;
    } else {
      block(term.off_diagonal) += term.h_ab.transpose();
    }
  }
  for (int place = 0; place < matrix_->size(); ++place) {
    block(matrix_->diagonal(place)).diagonal() += six(diagonal_, place) / radius;
  }
  if (!matrix_->factor()) return false;
  std::transform(gradient_.begin(), gradient_.end(), step_.begin(), [](double g) { return -g; });
  matrix_->solve(step_.data());
  return std::all_of(step_.begin(), step_.end(), [](double s) { return std::isfinite(s); });
}

/// By how much the linearised cost falls: -g.d / 2 + d.D d / 2, since (H + D) d = -g.
double PoseGraphSolver::expected_decrease(double radius) const {
  double sum = 0.0;
  for (std::size_t i = 0; i < step_.size(); ++i) {
    sum += step_[i] * (step_[i] * diagonal_[i] / radius - gradient_[i]);
  }
  return 0.5 * sum;
}

PoseGraphSolver::Poses PoseGraphSolver::moved() const {
  Poses result = poses_;
  for (std::size_t i = 0; i < result.size(); ++i) {
    if (places_[i] < 0) continue;
    const Eigen::Map<const Vector6d> step(step_.data() + 6 * at(places_[i]));
    result[i] = geometry::exp_se3(step) * result[i];
  }
  return result;
}

PoseGraphSolver::Outcome PoseGraphSolver::solve(int max_iterations, double tolerance) {
  constexpr double kNoGradient = 1e-10;
  constexpr double kWorthwhile = 1e-3;  // share of the expected decrease
  Outcome outcome{true, 0, "the iterations were used up"};
  double now = cost(poses_);
  double gradient = linearise();
  double shrink = 2.0;
  while (outcome.iterations < max_iterations) {
    if (gradient <= kNoGradient) {
      outcome.message = "converged: no gradient";
      break;
    }
    ++outcome.iterations;
    double ratio = -1.0;
    Poses next;
    double then = now;
    if (set_step(radius_)) {
      next = moved();
      then = cost(next);
      ratio = (now - then) / std::max(1e-300, expected_decrease(radius_));
    }
    if (!(ratio > kWorthwhile)) {
      // At the minimum no step gains anything beyond rounding.
      if (std::abs(now - then) <= tolerance * now && ratio > -1.0) {
        outcome.message = "converged: no step gains anything";
        break;
      }
      radius_ /= shrink;
      shrink *= 2.0;
      if (radius_ < kLeastRadius) return {false, outcome.iterations, "no step lowers the cost"};
      continue;
    }
    const bool converged = now - then <= tolerance * now;
    poses_ = std::move(next);
    now = then;
    const double t = 2.0 * ratio - 1.0;
    radius_ = std::min(kMostRadius, radius_ / std::max(1.0 / 3.0, 1.0 - t * t * t));
    shrink = 2.0;
    if (converged) {
      outcome.message = "converged";
      break;
    }
    gradient = linearise();
  }
  return outcome;
}

}  // namespace plumbline::optimize
