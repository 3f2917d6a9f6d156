// SPDX-License-Identifier: BSD-3-Clause
#include "bundle_solver.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "block_cholesky.hpp"
#include "bundle_terms.hpp"
#include "landmark_family.hpp"
#include "plumbline/core/clones.hpp"
#include "plumbline/optimize/pose_terms.hpp"

namespace plumbline::optimize {
namespace {

using geometry::Matrix6d;
using geometry::Rigid3;
using geometry::Vector6d;
using Points = LandmarkFamily<3>;
using Lines = LandmarkFamily<4>;

std::size_t at(int i) { return static_cast<std::size_t>(i); }

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

/// A point behind the camera: a constant, large error that the gate takes for an outlier.
constexpr double kBehind = 2e6;  // squared

PointTerm to_term(const BundlePointObservation& o) {
  PointTerm term;
  term.pixel = o.pixel;
  term.pixel_sigma = o.pixel_sigma;
  term.depth = o.depth;
  term.depth_sigma = o.depth_sigma;
  return term;
}

/// How many inliers see each landmark. What one pose alone sees without depth would leave its block singular.
template <typename Seen>
std::vector<int> views(const std::vector<Seen>& observations, int Seen::*landmark, std::size_t landmarks) {
  std::vector<int> count(landmarks, 0);
  for (const Seen& o : observations) {
    if (!o.outlier) ++count[at(o.*landmark)];
  }
  return count;
}

/// b - a: the product y w^T is subtracted from each target, column-major 6x6; y and w are 6 x unknowns.
struct Target {
  double* block;
  const double* w;
};
PLUMBLINE_CLONES
void subtract_products(const double* y, int unknowns, const Target* targets, std::size_t count) {
  for (std::size_t n = 0; n < count; ++n) {
    double* block = targets[n].block;
    const double* w = targets[n].w;
    for (int j = 0; j < 6; ++j) {
      double sum[6];
      for (int i = 0; i < 6; ++i) sum[i] = block[6 * j + i];
      for (int k = 0; k < unknowns; ++k) {
        const double factor = w[6 * k + j];
        for (int i = 0; i < 6; ++i) sum[i] -= y[6 * k + i] * factor;
      }
      for (int i = 0; i < 6; ++i) block[6 * j + i] = sum[i];
    }
  }
}

class Round {
 public:
  Round(const BundleProblem& problem, const BundleOptions& options, const core::Executor* executor,
        const BundleState& state)
      : problem_(problem),
        options_(options),
        executor_(executor),
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
    matrix_.emplace(free_, pairs_, executor_);
  }

  RoundSummary run(BundleState& state);

 private:
  template <typename Body>
  void each(std::size_t count, std::size_t grain, const Body& body) const {
    if (executor_ == nullptr || count <= grain) {
      for (std::size_t i = 0; i < count; ++i) body(i);
      return;
    }
    executor_->parallel_for((count + grain - 1) / grain, [&](std::size_t chunk) {
      const std::size_t end = std::min(count, (chunk + 1) * grain);
      for (std::size_t i = chunk * grain; i < end; ++i) body(i);
    });
  }

  void choose_sightings();
  void choose_slots();
  void add_sightings();
  void add_edges(const BundleState& state);
  void pair_poses();
  double sum_costs() const;
  [[nodiscard]] double cost(const BundleState& state);
  double linearise(const BundleState& state);
  void linearise_slot(std::size_t slot, const BundleState& state);
  void linearise_edge(std::size_t edge, const BundleState& state);
  void set_scales();
  void set_damping();
  [[nodiscard]] double largest_gradient() const;
  bool solve(double radius);
  template <typename Family>
  void eliminate(const Family& family, std::size_t slot, const std::vector<std::size_t>& block_of,
                 std::vector<Target>& targets, double* rhs);
  void assemble_row(std::size_t slot, double radius);
  void assemble_edges();
  [[nodiscard]] double model_decrease(double radius) const;
  void step(const BundleState& from, BundleState& to) const;
  [[nodiscard]] bool tiny_step(const BundleState& state) const;

  struct Edge {
    int a;  ///< slot; -1: the world
    int b;
    EdgeView view;
    bool robust;
    Rigid3 world;  ///< of a, if that is the world
    EdgeDerivatives j{};
    Vector6d r = Vector6d::Zero();
    double cost = 0.0;
  };

  const BundleProblem& problem_;
  const BundleOptions& options_;
  const core::Executor* executor_;
  Eigen::Matrix3d projection_;
  Huber point_loss_;
  Huber line_loss_;
  Huber edge_loss_;

  std::vector<int> used_points_;  ///< observations, of the problem
  std::vector<int> used_lines_;
  std::vector<int> slot_of_;    ///< of each pose
  std::vector<int> slot_pose_;  ///< pose of each slot
  int free_ = 0;
  std::vector<std::pair<int, int>> pairs_;  ///< of slots that share a block
  Points points_;
  Lines lines_;
  std::vector<PointTerm> point_terms_;  ///< of each sighting
  std::vector<LineView> line_views_;
  std::vector<Edge> edges_;

  std::vector<Matrix6d> normal_;  ///< of each free slot: J^T J
  std::vector<Vector6d> gradient_;
  std::vector<Damping<6>> damping_;
  std::vector<double> pose_steps_;
  std::vector<double> costs_;
  std::optional<BlockCholesky> matrix_;
};

void Round::choose_sightings() {
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
void Round::choose_slots() {
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
void Round::pair_poses() {
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

void Round::add_sightings() {
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
void Round::add_edges(const BundleState& state) {
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

double Round::sum_costs() const {
  double sum = 0.0;
  for (const double c : costs_) sum += c;
  for (const Edge& edge : edges_) sum += edge.cost;
  return sum;
}

double Round::cost(const BundleState& state) {
  each(slot_pose_.size(), 1, [&](std::size_t slot) {
    const Rigid3& pose = state.poses[at(slot_pose_[slot])];
    double sum = 0.0;
    for (std::size_t i = points_.slot_begin[slot]; i < points_.slot_begin[slot + 1]; ++i) {
      point_terms_[i].world = state.points[at(points_.sightings[i].landmark)];
      Eigen::Vector3d r;
      const int rows = point_residual(point_terms_[i], pose, problem_.camera, r, nullptr);
      sum += point_loss_.cost(rows == 0 ? kBehind : r.squaredNorm());
    }
    for (std::size_t i = lines_.slot_begin[slot]; i < lines_.slot_begin[slot + 1]; ++i) {
      const Eigen::Vector4d r = line_rows(line_views_[i], projection_, pose,
                                          state.lines[at(lines_.sightings[i].landmark)], nullptr);
      sum += line_loss_.cost(r.squaredNorm());
    }
    costs_[slot] = sum;
  });
  each(edges_.size(), 64, [&](std::size_t i) {
    Edge& edge = edges_[i];
    const Rigid3& a = edge.a < 0 ? edge.world : state.poses[at(slot_pose_[at(edge.a)])];
    const double e = edge_rows(edge.view, a, state.poses[at(slot_pose_[at(edge.b)])], nullptr).squaredNorm();
    edge.cost = edge.robust ? edge_loss_.cost(e) : 0.5 * e;
  });
  return sum_costs();
}

void Round::linearise_slot(std::size_t slot, const BundleState& state) {
  const Rigid3& pose = state.poses[at(slot_pose_[slot])];
  Matrix6d normal = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
  double sum = 0.0;
  for (std::size_t i = points_.slot_begin[slot]; i < points_.slot_begin[slot + 1]; ++i) {
    point_terms_[i].world = state.points[at(points_.sightings[i].landmark)];
    Eigen::Vector3d r;
    Eigen::Matrix<double, 3, 6> j;
    if (point_residual(point_terms_[i], pose, problem_.camera, r, &j) == 0) {
      sum += point_loss_.cost(kBehind);
      points_.cross[i].setZero();
      points_.square[i].setZero();
      points_.gradients[i].setZero();
      continue;
    }
    const double squared = r.squaredNorm();
    const double weight = point_loss_.weight(squared);
    sum += point_loss_.cost(squared);
    Matrix6d h;
    h.noalias() = weight * (j.transpose() * j);
    Vector6d g;
    g.noalias() = weight * (j.transpose() * r);
    normal += h;
    gradient += g;
    points_.cross[i].noalias() = h.leftCols<3>() * pose.rotation;  // de/dP = de/drho R
    points_.square[i].noalias() = pose.rotation.transpose() * points_.cross[i].topRows<3>();
    points_.gradients[i].noalias() = pose.rotation.transpose() * g.head<3>();
  }
  LineDerivatives j;
  for (std::size_t i = lines_.slot_begin[slot]; i < lines_.slot_begin[slot + 1]; ++i) {
    const Eigen::Vector4d r =
        line_rows(line_views_[i], projection_, pose, state.lines[at(lines_.sightings[i].landmark)], &j);
    const double squared = r.squaredNorm();
    const double weight = line_loss_.weight(squared);
    sum += line_loss_.cost(squared);
    normal.noalias() += weight * (j.by_pose.transpose() * j.by_pose);
    gradient.noalias() += weight * (j.by_pose.transpose() * r);
    lines_.cross[i].noalias() = weight * (j.by_pose.transpose() * j.by_line);
    lines_.square[i].noalias() = weight * (j.by_line.transpose() * j.by_line);
    lines_.gradients[i].noalias() = weight * (j.by_line.transpose() * r);
  }
  costs_[slot] = sum;
  if (slot >= at(free_)) return;
  normal_[slot] = normal;
  gradient_[slot] = gradient;
}

void Round::linearise_edge(std::size_t index, const BundleState& state) {
  Edge& edge = edges_[index];
  const Rigid3& a = edge.a < 0 ? edge.world : state.poses[at(slot_pose_[at(edge.a)])];
  edge.r = edge_rows(edge.view, a, state.poses[at(slot_pose_[at(edge.b)])], &edge.j);
  const double squared = edge.r.squaredNorm();
  edge.cost = edge.robust ? edge_loss_.cost(squared) : 0.5 * squared;
  const double root = edge.robust ? std::sqrt(edge_loss_.weight(squared)) : 1.0;
  edge.r *= root;
  edge.j.by_a *= root;
  edge.j.by_b *= root;
}

double Round::linearise(const BundleState& state) {
  each(slot_pose_.size(), 1, [&](std::size_t slot) { linearise_slot(slot, state); });
  each(edges_.size(), 64, [&](std::size_t i) { linearise_edge(i, state); });
  for (const Edge& edge : edges_) {
    if (edge.a >= 0 && edge.a < free_) {
      normal_[at(edge.a)].noalias() += edge.j.by_a.transpose() * edge.j.by_a;
      gradient_[at(edge.a)].noalias() += edge.j.by_a.transpose() * edge.r;
    }
    if (edge.b < free_) {
      normal_[at(edge.b)].noalias() += edge.j.by_b.transpose() * edge.j.by_b;
      gradient_[at(edge.b)].noalias() += edge.j.by_b.transpose() * edge.r;
    }
  }
  each(points_.hessian.size(), 512, [&](std::size_t i) { points_.sum(i); });
  each(lines_.hessian.size(), 512, [&](std::size_t i) { lines_.sum(i); });
  return sum_costs();
}

void Round::set_scales() {
  for (std::size_t i = 0; i < normal_.size(); ++i) damping_[i].set_scale(normal_[i].diagonal());
  for (std::size_t i = 0; i < points_.hessian.size(); ++i)
    points_.damping[i].set_scale(points_.hessian[i].diagonal());
  for (std::size_t i = 0; i < lines_.hessian.size(); ++i)
    lines_.damping[i].set_scale(lines_.hessian[i].diagonal());
}

void Round::set_damping() {
  for (std::size_t i = 0; i < normal_.size(); ++i) damping_[i].set_diagonal(normal_[i].diagonal());
  for (std::size_t i = 0; i < points_.hessian.size(); ++i) {
    points_.damping[i].set_diagonal(points_.hessian[i].diagonal());
  }
  for (std::size_t i = 0; i < lines_.hessian.size(); ++i) {
    lines_.damping[i].set_diagonal(lines_.hessian[i].diagonal());
  }
}

double Round::largest_gradient() const {
  double largest = 0.0;
  for (const Vector6d& g : gradient_) largest = std::max(largest, g.cwiseAbs().maxCoeff());
  for (const Eigen::Vector3d& g : points_.gradient) largest = std::max(largest, g.cwiseAbs().maxCoeff());
  for (const Eigen::Vector4d& g : lines_.gradient) largest = std::max(largest, g.cwiseAbs().maxCoeff());
  return largest;
}

template <typename Family>
void Round::eliminate(const Family& family, std::size_t slot, const std::vector<std::size_t>& block_of,
                      std::vector<Target>& targets, double* rhs) {
  Eigen::Map<Vector6d> b(rhs);
  for (std::size_t i = family.slot_begin[slot]; i < family.slot_begin[slot + 1]; ++i) {
    const auto landmark = at(family.sightings[i].landmark);
    const typename Family::Cross y = family.cross[i] * family.inverse[landmark];
    b.noalias() += family.cross[i] * family.step[landmark];
    targets.clear();
    for (std::size_t k = family.landmark_begin[landmark]; k < family.landmark_begin[landmark + 1]; ++k) {
      const auto other = at(family.by_landmark[k]);
      const auto column = at(family.sightings[other].slot);
      if (column > slot) break;
      double* block =
          column == slot ? matrix_->diagonal(static_cast<int>(slot)) : matrix_->block(block_of[column]);
      targets.push_back({block, family.cross[other].data()});
    }
    subtract_products(y.data(), static_cast<int>(Family::Vector::RowsAtCompileTime), targets.data(),
                      targets.size());
  }
}

/// The row of the reduced equations that belongs to a free slot.
void Round::assemble_row(std::size_t slot, double radius) {
  const int row = static_cast<int>(slot);
  thread_local std::vector<std::size_t> block_of;  // of each column that the row has a block in
  thread_local std::vector<Target> targets;
  block_of.resize(std::max(block_of.size(), slot + 1));
  for (const auto* entry = matrix_->row_begin(row); entry != matrix_->row_end(row); ++entry) {
    block_of[at(entry->column)] = entry->block;
  }
  Eigen::Map<Matrix6d> diagonal(matrix_->diagonal(row));
  diagonal = normal_[slot];
  diagonal.diagonal() += damping_[slot].diagonal / radius;
  double* rhs = pose_steps_.data() + 6 * slot;
  Eigen::Map<Vector6d> start(rhs);
  start = -gradient_[slot];
  eliminate(points_, slot, block_of, targets, rhs);
  eliminate(lines_, slot, block_of, targets, rhs);
}

void Round::assemble_edges() {
  for (const Edge& edge : edges_) {
    if (edge.a < 0 || edge.a >= free_ || edge.b >= free_ || edge.a == edge.b) continue;
    if (edge.a > edge.b) {
      Eigen::Map<Matrix6d>(matrix_->block(edge.a, edge.b)).noalias() += edge.j.by_a.transpose() * edge.j.by_b;
    } else {
      Eigen::Map<Matrix6d>(matrix_->block(edge.b, edge.a)).noalias() += edge.j.by_b.transpose() * edge.j.by_a;
    }
  }
}

/// The step of all unknowns at this radius; false when the equations cannot be solved.
bool Round::solve(double radius) {
  each(points_.hessian.size(), 512, [&](std::size_t i) { points_.invert(i, radius); });
  each(lines_.hessian.size(), 512, [&](std::size_t i) { lines_.invert(i, radius); });
  matrix_->set_zero();
  each(at(free_), 4, [&](std::size_t slot) { assemble_row(slot, radius); });
  assemble_edges();
  if (!matrix_->factor()) return false;
  matrix_->solve(pose_steps_.data());
  for (const double s : pose_steps_) {
    if (!std::isfinite(s)) return false;
  }
  each(points_.hessian.size(), 512,
       [&](std::size_t i) { points_.substitute_back(i, pose_steps_.data(), free_); });
  each(lines_.hessian.size(), 512,
       [&](std::size_t i) { lines_.substitute_back(i, pose_steps_.data(), free_); });
  return true;
}

/// By how much the linearised cost falls: -g.d / 2 + d.D d / 2, since (H + D) d = -g.
double Round::model_decrease(double radius) const {
  double gradient = 0.0;
  double damped = 0.0;
  for (std::size_t i = 0; i < normal_.size(); ++i) {
    const Eigen::Map<const Vector6d> d(pose_steps_.data() + 6 * i);
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

void Round::step(const BundleState& from, BundleState& to) const {
  for (std::size_t i = 0; i < at(free_); ++i) {
    const Eigen::Map<const Vector6d> d(pose_steps_.data() + 6 * i);
    const auto pose = at(slot_pose_[i]);
    to.poses[pose] = geometry::exp_se3(d) * from.poses[pose];
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
bool Round::tiny_step(const BundleState& state) const {
  constexpr double kShare = 1e-7;
  double moved = 0.0;
  for (const double s : pose_steps_) moved += s * s;
  for (const Eigen::Vector3d& s : points_.step) moved += s.squaredNorm();
  for (const Eigen::Vector4d& s : lines_.step) moved += s.squaredNorm();
  double size = static_cast<double>(state.poses.size() + 2 * state.lines.size());
  for (const Rigid3& pose : state.poses) size += pose.translation.squaredNorm();
  for (const Eigen::Vector3d& p : state.points) size += p.squaredNorm();
  return std::sqrt(moved) <= kShare * (std::sqrt(size) + kShare);
}

RoundSummary Round::run(BundleState& state) {
  constexpr double kGradientTolerance = 1e-10;
  constexpr double kLeastGain = 1e-3;  // share of what was promised that a step must bring
  constexpr double kLargestRadius = 1e16;
  constexpr double kSmallestRadius = 1e-32;
  RoundSummary summary;
  double radius = 1e4;
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

}  // namespace

RoundSummary solve_bundle_round(const BundleProblem& problem, const BundleOptions& options,
                                const core::Executor* executor, BundleState& state) {
  return Round(problem, options, executor, state).run(state);
}

}  // namespace plumbline::optimize
