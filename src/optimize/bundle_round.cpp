// SPDX-License-Identifier: BSD-3-Clause
#include "bundle_round.hpp"

namespace plumbline::optimize {
namespace {

/// How many inliers see each landmark. What one pose alone sees without depth would leave its block singular.
template <typename Seen>
std::vector<int> views(const std::vector<Seen>& observations, int Seen::*landmark, std::size_t landmarks) {
  std::vector<int> count(landmarks, 0);
  for (const Seen& o : observations) {
    if (!o.outlier) ++count[at(o.*landmark)];
  }
  return count;
}

}  // namespace

UsedObservations::UsedObservations(const BundleProblem& problem) {
  const std::vector<int> point_views =
      views(problem.point_observations, &BundlePointObservation::point, problem.points.size());
  for (std::size_t i = 0; i < problem.point_observations.size(); ++i) {
    const BundlePointObservation& o = problem.point_observations[i];
    if (!o.outlier && (point_views[at(o.point)] > 1 || o.depth > 0.0)) points.push_back(static_cast<int>(i));
  }
  const std::vector<int> line_views =
      views(problem.line_observations, &BundleLineObservation::line, problem.lines.size());
  for (std::size_t i = 0; i < problem.line_observations.size(); ++i) {
    const BundleLineObservation& o = problem.line_observations[i];
    if (!o.outlier && (line_views[at(o.line)] > 1 || o.has_depth)) lines.push_back(static_cast<int>(i));
  }
}

BundleRound::BundleRound(const BundleProblem& problem, const BundleOptions& options)
    : problem_(problem),
      options_(options),
      projection_(geometry::line_projection(problem.camera.fx, problem.camera.fy, problem.camera.cx,
                                            problem.camera.cy)),
      point_loss_{options.point_loss},
      line_loss_{options.line_loss},
      edge_loss_{options.edge_loss} {
  choose_slots();
  add_observations();
  for (const BundleEdge& edge : problem.edges)
    edges_.push_back({slot_of_[at(edge.a)], slot_of_[at(edge.b)], EdgeView(edge), true});
  normal_.resize(at(free_));
  gradient_.resize(at(free_));
  damping_.resize(at(free_));
  pose_steps_.resize(6 * free_);
  matrix_.resize(6 * free_, 6 * free_);
}

/// Free poses first.
void BundleRound::choose_slots() {
  slot_of_.resize(problem_.poses.size());
  for (const bool fixed : {false, true}) {
    for (std::size_t i = 0; i < problem_.poses.size(); ++i) {
      if (problem_.poses[i].fixed != fixed) continue;
      slot_of_[i] = static_cast<int>(slot_pose_.size());
      slot_pose_.push_back(static_cast<int>(i));
    }
    if (!fixed) free_ = static_cast<int>(slot_pose_.size());
  }
}

void BundleRound::add_observations() {
  UsedObservations used(problem_);
  const auto by_slot = [&](std::vector<int>& numbers, const auto& observations) {
    std::stable_sort(numbers.begin(), numbers.end(), [&](int a, int b) {
      return slot_of_[at(observations[at(a)].pose)] < slot_of_[at(observations[at(b)].pose)];
    });
  };
  by_slot(used.points, problem_.point_observations);
  for (const int i : used.points) {
    const BundlePointObservation& o = problem_.point_observations[at(i)];
    points_.observations.push_back({slot_of_[at(o.pose)], o.point});
    point_terms_.push_back(to_term(o));
  }
  points_.prepare(slot_pose_.size(), problem_.points.size());
  by_slot(used.lines, problem_.line_observations);
  for (const int i : used.lines) {
    const BundleLineObservation& o = problem_.line_observations[at(i)];
    lines_.observations.push_back({slot_of_[at(o.pose)], o.line});
    line_views_.emplace_back(o, problem_.camera);
  }
  lines_.prepare(slot_pose_.size(), problem_.lines.size());
}

void BundleRound::hold(const BundleState& state) {
  for (const BundleEdge& stay : holding_edges(problem_, state))
    edges_.push_back({-1, slot_of_[at(stay.b)], EdgeView(stay), false});
}

std::vector<BundleEdge> holding_edges(const BundleProblem& problem, const BundleState& state) {
  std::vector<BundleEdge> stays;
  std::vector<char> held(problem.poses.size(), 0);
  for (const BundleEdge& edge : problem.edges) {
    for (const int i : {edge.a, edge.b}) {
      if (held[at(i)] != 0 || problem.poses[at(i)].fixed) continue;
      held[at(i)] = 1;
      stays.push_back({-1, i, state.poses[at(i)], geometry::Matrix6d::Identity()});
    }
  }
  return stays;
}

}  // namespace plumbline::optimize
