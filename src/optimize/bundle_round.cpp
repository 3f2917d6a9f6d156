// SPDX-License-Identifier: BSD-3-Clause
#include "bundle_round.hpp"

namespace plumbline::optimize {
namespace {

/// Counts the inliers that see each landmark. One that a single pose sees without depth would make its block
/// singular.
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
  // A point seen once needs its depth
  const std::vector<int> point_views =
      views(problem.point_observations, &BundlePointObservation::point, problem.points.size());
  for (std::size_t i = 0; i < problem.point_observations.size(); ++i) {
    const BundlePointObservation& o = problem.point_observations[i];
    if (!o.outlier && (point_views[at(o.point)] > 1 || o.depth > 0.0)) points.push_back(static_cast<int>(i));
  }

  // A line seen once does as well
  const std::vector<int> line_views =
      views(problem.line_observations, &BundleLineObservation::line, problem.lines.size());
  for (std::size_t i = 0; i < problem.line_observations.size(); ++i) {
    const BundleLineObservation& o = problem.line_observations[i];
    if (!o.outlier && (line_views[at(o.line)] > 1 || o.has_depth)) lines.push_back(static_cast<int>(i));
  }
}

PoseSlots::PoseSlots(const BundleProblem& problem) : of_pose(problem.poses.size()) {
  // Free poses come first
  for (const bool fixed : {false, true}) {
    for (std::size_t i = 0; i < problem.poses.size(); ++i) {
      if (problem.poses[i].fixed != fixed) continue;
      of_pose[i] = static_cast<int>(pose.size());
      pose.push_back(static_cast<int>(i));
    }
    if (!fixed) free = static_cast<int>(pose.size());
  }
}

BundleRound::BundleRound(const BundleProblem& problem, const BundleOptions& options)
    : problem_(problem),
      options_(options),
      projection_(geometry::line_projection(problem.camera.fx, problem.camera.fy, problem.camera.cx,
                                            problem.camera.cy)),
      slots_(problem),
      reduced_(slots_.free) {
  add_observations();
  for (const BundleEdge& edge : problem.edges)
    equations_.edges.push_back(
        {slots_.of_pose[at(edge.a)], slots_.of_pose[at(edge.b)], EdgeView(edge), true});

  // Only free poses are unknowns
  equations_.hessian.resize(at(slots_.free));
  equations_.gradient.resize(at(slots_.free));
  equations_.damping.resize(at(slots_.free));
}

void BundleRound::add_observations() {
  UsedObservations used(problem_);

  // Observations of one pose next to each other
  const auto by_slot = [&](std::vector<int>& numbers, const auto& observations) {
    std::stable_sort(numbers.begin(), numbers.end(), [&](int a, int b) {
      return slots_.of_pose[at(observations[at(a)].pose)] < slots_.of_pose[at(observations[at(b)].pose)];
    });
  };
  by_slot(used.points, problem_.point_observations);

  for (const int i : used.points) {
    const BundlePointObservation& o = problem_.point_observations[at(i)];
    equations_.points.observations.push_back({slots_.of_pose[at(o.pose)], o.point});
    point_terms_.push_back(to_term(o));
  }
  equations_.points.prepare(slots_.pose.size(), problem_.points.size());

  by_slot(used.lines, problem_.line_observations);
  for (const int i : used.lines) {
    const BundleLineObservation& o = problem_.line_observations[at(i)];
    equations_.lines.observations.push_back({slots_.of_pose[at(o.pose)], o.line});
    line_views_.emplace_back(o, problem_.camera);
  }
  equations_.lines.prepare(slots_.pose.size(), problem_.lines.size());
}

void BundleRound::hold(const BundleState& state) {
  for (const BundleEdge& stay : holding_edges(problem_, state))
    equations_.edges.push_back({-1, slots_.of_pose[at(stay.b)], EdgeView(stay), false});
}

std::vector<BundleEdge> holding_edges(const BundleProblem& problem, const BundleState& state) {
  std::vector<BundleEdge> stays;
  std::vector<char> held(problem.poses.size(), 0);

  // Once for each free pose with an edge
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
