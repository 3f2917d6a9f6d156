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

BundleRound::BundleRound(const BundleProblem& problem, const BundleOptions& options, core::Crew& crew,
                         const BundleState& state)
    : problem_(problem),
      options_(options),
      crew_(crew),
      projection_(geometry::line_projection(problem.camera.fx, problem.camera.fy, problem.camera.cx,
                                            problem.camera.cy)),
      point_loss_{options.point_loss},
      line_loss_{options.line_loss},
      edge_loss_{options.edge_loss} {
  choose_sightings();
  choose_slots();
  add_sightings();
  add_edges(state);
  normal_.resize(at(free_));
  gradient_.resize(at(free_));
  damping_.resize(at(free_));
  pose_steps_.assign(6 * at(free_), 0.0);
  costs_.assign(slot_pose_.size(), 0.0);
  matrix_.emplace(free_, pairs_, &crew_);
}

void BundleRound::choose_sightings() {
  const std::vector<int> point_views =
      views(problem_.point_observations, &BundlePointObservation::point, problem_.points.size());
  for (std::size_t i = 0; i < problem_.point_observations.size(); ++i) {
    const BundlePointObservation& o = problem_.point_observations[i];
    if (o.outlier || (point_views[at(o.point)] < 2 && !(o.depth > 0.0))) continue;
    used_points_.push_back(static_cast<int>(i));
  }
  const std::vector<int> line_views =
      views(problem_.line_observations, &BundleLineObservation::line, problem_.lines.size());
  for (std::size_t i = 0; i < problem_.line_observations.size(); ++i) {
    const BundleLineObservation& o = problem_.line_observations[i];
    if (o.outlier || (line_views[at(o.line)] < 2 && !o.has_depth)) continue;
    used_lines_.push_back(static_cast<int>(i));
  }
}

/// Free poses at their places in the elimination, then the others. `slot_of_` is the number among the free
/// ones first.
void BundleRound::choose_slots() {
  slot_of_.resize(problem_.poses.size());
  for (std::size_t i = 0; i < problem_.poses.size(); ++i)
    slot_of_[i] = problem_.poses[i].fixed ? -1 : free_++;
  pair_poses();
  const std::vector<int> places = elimination_places(free_, pairs_);
  slot_pose_.resize(problem_.poses.size());
  int next = free_;
  for (std::size_t i = 0; i < problem_.poses.size(); ++i) {
    slot_of_[i] = slot_of_[i] < 0 ? next++ : places[at(slot_of_[i])];
    slot_pose_[at(slot_of_[i])] = static_cast<int>(i);
  }
  for (auto& [a, b] : pairs_) {
    a = places[at(a)];
    b = places[at(b)];
  }
}

/// Poses that see the same landmark or have an edge, each pair once.
void BundleRound::pair_poses() {
  std::vector<std::vector<int>> partners(at(free_));  // of the higher number: the lower
  const auto add = [&](int pose_a, int pose_b) {
    const int a = slot_of_[at(pose_a)];
    const int b = slot_of_[at(pose_b)];
    if (a >= 0 && b >= 0 && a != b) partners[at(std::max(a, b))].push_back(std::min(a, b));
  };
  const auto add_tracks = [&](std::size_t landmarks, const std::vector<int>& used, const auto& observations,
                              auto landmark) {
    std::vector<std::vector<int>> seen_by(landmarks);
    for (const int i : used) seen_by[at(observations[at(i)].*landmark)].push_back(observations[at(i)].pose);
    for (const std::vector<int>& poses : seen_by) {
      for (std::size_t i = 1; i < poses.size(); ++i) {
        for (std::size_t j = 0; j < i; ++j) add(poses[i], poses[j]);
      }
    }
  };
  add_tracks(problem_.points.size(), used_points_, problem_.point_observations,
             &BundlePointObservation::point);
  add_tracks(problem_.lines.size(), used_lines_, problem_.line_observations, &BundleLineObservation::line);
  for (const BundleEdge& edge : problem_.edges) add(edge.a, edge.b);
  for (std::size_t i = 0; i < partners.size(); ++i) {
    std::sort(partners[i].begin(), partners[i].end());
    partners[i].erase(std::unique(partners[i].begin(), partners[i].end()), partners[i].end());
    for (const int j : partners[i]) pairs_.emplace_back(static_cast<int>(i), j);
  }
}

void BundleRound::add_sightings() {
  const auto by_slot = [&](std::vector<int>& used, const auto& observations) {
    std::stable_sort(used.begin(), used.end(), [&](int a, int b) {
      return slot_of_[at(observations[at(a)].pose)] < slot_of_[at(observations[at(b)].pose)];
    });
  };
  by_slot(used_points_, problem_.point_observations);
  for (const int i : used_points_) {
    const BundlePointObservation& o = problem_.point_observations[at(i)];
    points_.sightings.push_back({slot_of_[at(o.pose)], o.point});
    point_terms_.push_back(to_term(o));
  }
  points_.prepare(slot_pose_.size(), problem_.points.size());
  by_slot(used_lines_, problem_.line_observations);
  for (const int i : used_lines_) {
    const BundleLineObservation& o = problem_.line_observations[at(i)];
    lines_.sightings.push_back({slot_of_[at(o.pose)], o.line});
    line_views_.emplace_back(o, problem_.camera);
  }
  lines_.prepare(slot_pose_.size(), problem_.lines.size());
}

/// Poses that edges hold are held to where they are by 1 m and 1 rad as well: far weaker than anything
/// measured, but directions that an edge leaves free would otherwise run off (damping scales each unknown
/// by what is known of it, and so prefers to move along them).
void BundleRound::add_edges(const BundleState& state) {
  std::vector<char> held(problem_.poses.size(), 0);
  for (const BundleEdge& edge : problem_.edges) {
    edges_.push_back({slot_of_[at(edge.a)], slot_of_[at(edge.b)], EdgeView(edge), true, {}});
    for (const int i : {edge.a, edge.b}) {
      if (held[at(i)] != 0 || problem_.poses[at(i)].fixed) continue;
      held[at(i)] = 1;
      const BundleEdge stay{-1, i, state.poses[at(i)], Matrix6d::Identity()};
      edges_.push_back({-1, slot_of_[at(i)], EdgeView(stay), false, {}});
    }
  }
}

}  // namespace plumbline::optimize
