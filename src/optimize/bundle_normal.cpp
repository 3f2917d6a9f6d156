// SPDX-License-Identifier: BSD-3-Clause
#include "bundle_round.hpp"

namespace plumbline::optimize {
namespace {

using geometry::Matrix6d;
using geometry::Rigid3;
using geometry::Vector6d;

}  // namespace

double BundleRound::cost(const BundleState& state) {
  double sum = 0.0;
  for (std::size_t slot = 0; slot < slot_pose_.size(); ++slot) {
    const Rigid3& pose = state.poses[at(slot_pose_[slot])];
    for (std::size_t i = points_.slot_begin[slot]; i < points_.slot_begin[slot + 1]; ++i) {
      point_terms_[i].world = state.points[at(points_.observations[i].landmark)];
      Eigen::Vector3d r;
      const int rows = point_residual(point_terms_[i], pose, problem_.camera, r, nullptr);
      sum += point_loss_.cost(rows == 0 ? kBehind : r.squaredNorm());
    }
    for (std::size_t i = lines_.slot_begin[slot]; i < lines_.slot_begin[slot + 1]; ++i) {
      const Eigen::Vector4d r = line_rows(line_views_[i], projection_, pose,
                                          state.lines[at(lines_.observations[i].landmark)], nullptr);
      sum += line_loss_.cost(r.squaredNorm());
    }
  }
  for (const Edge& edge : edges_) {
    const Rigid3 a = edge.a < 0 ? Rigid3() : state.poses[at(slot_pose_[at(edge.a)])];
    const double e = edge_rows(edge.view, a, state.poses[at(slot_pose_[at(edge.b)])], nullptr).squaredNorm();
    sum += edge.robust ? edge_loss_.cost(e) : 0.5 * e;
  }
  return sum;
}

double BundleRound::linearise_slot(std::size_t slot, const BundleState& state) {
  const Rigid3& pose = state.poses[at(slot_pose_[slot])];
  Matrix6d normal = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
  double sum = 0.0;
  for (std::size_t i = points_.slot_begin[slot]; i < points_.slot_begin[slot + 1]; ++i) {
    point_terms_[i].world = state.points[at(points_.observations[i].landmark)];
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
        line_rows(line_views_[i], projection_, pose, state.lines[at(lines_.observations[i].landmark)], &j);
    const double squared = r.squaredNorm();
    const double weight = line_loss_.weight(squared);
    sum += line_loss_.cost(squared);
    normal.noalias() += weight * (j.by_pose.transpose() * j.by_pose);
    gradient.noalias() += weight * (j.by_pose.transpose() * r);
    lines_.cross[i].noalias() = weight * (j.by_pose.transpose() * j.by_line);
    lines_.square[i].noalias() = weight * (j.by_line.transpose() * j.by_line);
    lines_.gradients[i].noalias() = weight * (j.by_line.transpose() * r);
  }
  if (slot < at(free_)) {
    normal_[slot] = normal;
    gradient_[slot] = gradient;
  }
  return sum;
}

double BundleRound::linearise_edge(Edge& edge, const BundleState& state) {
  const Rigid3 a = edge.a < 0 ? Rigid3() : state.poses[at(slot_pose_[at(edge.a)])];
  edge.r = edge_rows(edge.view, a, state.poses[at(slot_pose_[at(edge.b)])], &edge.j);
  const double squared = edge.r.squaredNorm();
  const double root = edge.robust ? std::sqrt(edge_loss_.weight(squared)) : 1.0;
  edge.r *= root;
  edge.j.by_a *= root;
  edge.j.by_b *= root;
  if (edge.a >= 0 && edge.a < free_) {
    normal_[at(edge.a)].noalias() += edge.j.by_a.transpose() * edge.j.by_a;
    gradient_[at(edge.a)].noalias() += edge.j.by_a.transpose() * edge.r;
  }
  if (edge.b < free_) {
    normal_[at(edge.b)].noalias() += edge.j.by_b.transpose() * edge.j.by_b;
    gradient_[at(edge.b)].noalias() += edge.j.by_b.transpose() * edge.r;
  }
  return edge.robust ? edge_loss_.cost(squared) : 0.5 * squared;
}

double BundleRound::linearise(const BundleState& state) {
  double sum = 0.0;
  for (std::size_t slot = 0; slot < slot_pose_.size(); ++slot) sum += linearise_slot(slot, state);
  for (Edge& edge : edges_) sum += linearise_edge(edge, state);
  points_.sum();
  lines_.sum();
  return sum;
}

void BundleRound::set_scales() {
  for (std::size_t i = 0; i < normal_.size(); ++i) damping_[i].set_scale(normal_[i].diagonal());
  points_.set_scales();
  lines_.set_scales();
}

void BundleRound::set_damping() {
  for (std::size_t i = 0; i < normal_.size(); ++i) damping_[i].set_diagonal(normal_[i].diagonal());
  points_.set_damping();
  lines_.set_damping();
}

double BundleRound::largest_gradient() const {
  double largest = 0.0;
  for (const Vector6d& g : gradient_) largest = std::max(largest, g.cwiseAbs().maxCoeff());
  for (const Eigen::Vector3d& g : points_.gradient) largest = std::max(largest, g.cwiseAbs().maxCoeff());
  for (const Eigen::Vector4d& g : lines_.gradient) largest = std::max(largest, g.cwiseAbs().maxCoeff());
  return largest;
}

}  // namespace plumbline::optimize
