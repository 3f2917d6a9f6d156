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
  for (std::size_t slot = 0; slot < slots_.pose.size(); ++slot) {
    const Rigid3& pose = state.poses[at(slots_.pose[slot])];

    // Points; behind the camera they cost a constant
    for (std::size_t i = equations_.points.slot_begin[slot]; i < equations_.points.slot_begin[slot + 1];
         ++i) {
      point_terms_[i].world = state.points[at(equations_.points.observations[i].landmark)];
      Eigen::Vector3d r;
      const int rows = point_residual(point_terms_[i], pose, problem_.camera, r, nullptr);
      sum += Huber{options_.point_loss}.cost(rows == 0 ? kBehind : r.squaredNorm());
    }

    for (std::size_t i = equations_.lines.slot_begin[slot]; i < equations_.lines.slot_begin[slot + 1]; ++i) {
      const Eigen::Vector4d r =
          line_rows(line_views_[i], projection_, pose,
                    state.lines[at(equations_.lines.observations[i].landmark)], nullptr);
      sum += Huber{options_.line_loss}.cost(r.squaredNorm());
    }
  }

  // Edges; without a first pose, from the world
  for (const RoundEdge& edge : equations_.edges) {
    const Rigid3 a = edge.a < 0 ? Rigid3() : state.poses[at(slots_.pose[at(edge.a)])];
    const double e = edge_rows(edge.view, a, state.poses[at(slots_.pose[at(edge.b)])], nullptr).squaredNorm();
    sum += edge.robust ? Huber{options_.edge_loss}.cost(e) : 0.5 * e;
  }

  return sum;
}

double BundleRound::linearise_slot(std::size_t slot, const BundleState& state) {
  const Rigid3& pose = state.poses[at(slots_.pose[slot])];
  Matrix6d normal = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
  double sum = 0.0;

  // Points: normal equations of pose, landmark and both
  for (std::size_t i = equations_.points.slot_begin[slot]; i < equations_.points.slot_begin[slot + 1]; ++i) {
    point_terms_[i].world = state.points[at(equations_.points.observations[i].landmark)];
    Eigen::Vector3d r;
    Eigen::Matrix<double, 3, 6> j;
    if (point_residual(point_terms_[i], pose, problem_.camera, r, &j) == 0) {
      sum += Huber{options_.point_loss}.cost(kBehind);
      equations_.points.cross[i].setZero();
      equations_.points.square[i].setZero();
      equations_.points.gradients[i].setZero();
      continue;
    }

    const double squared = r.squaredNorm();
    const double weight = Huber{options_.point_loss}.weight(squared);
    sum += Huber{options_.point_loss}.cost(squared);
    Matrix6d h;
    h.noalias() = weight * (j.transpose() * j);
    Vector6d g;
    g.noalias() = weight * (j.transpose() * r);

    normal += h;
    gradient += g;
    equations_.points.cross[i].noalias() = h.leftCols<3>() * pose.rotation;  // de/dP = de/drho R
    equations_.points.square[i].noalias() =
        pose.rotation.transpose() * equations_.points.cross[i].topRows<3>();
    equations_.points.gradients[i].noalias() = pose.rotation.transpose() * g.head<3>();
  }

  // Lines likewise
  LineDerivatives j;
  for (std::size_t i = equations_.lines.slot_begin[slot]; i < equations_.lines.slot_begin[slot + 1]; ++i) {
    const Eigen::Vector4d r = line_rows(line_views_[i], projection_, pose,
                                        state.lines[at(equations_.lines.observations[i].landmark)], &j);
    const double squared = r.squaredNorm();
    const double weight = Huber{options_.line_loss}.weight(squared);

    sum += Huber{options_.line_loss}.cost(squared);
    normal.noalias() += weight * (j.by_pose.transpose() * j.by_pose);
    gradient.noalias() += weight * (j.by_pose.transpose() * r);
    equations_.lines.cross[i].noalias() = weight * (j.by_pose.transpose() * j.by_line);
    equations_.lines.square[i].noalias() = weight * (j.by_line.transpose() * j.by_line);
    equations_.lines.gradients[i].noalias() = weight * (j.by_line.transpose() * r);
  }

  // Fixed poses are not unknowns
  if (slot < at(slots_.free)) {
    equations_.hessian[slot] = normal;
    equations_.gradient[slot] = gradient;
  }

  return sum;
}

double BundleRound::linearise_edge(RoundEdge& edge, const BundleState& state) {
  const Rigid3 a = edge.a < 0 ? Rigid3() : state.poses[at(slots_.pose[at(edge.a)])];
  edge.r = edge_rows(edge.view, a, state.poses[at(slots_.pose[at(edge.b)])], &edge.j);

  // The robust weight scales residual and derivatives
  const double squared = edge.r.squaredNorm();
  const double root = edge.robust ? std::sqrt(Huber{options_.edge_loss}.weight(squared)) : 1.0;
  edge.r *= root;
  edge.j.by_a *= root;
  edge.j.by_b *= root;

  // Only free poses are unknowns
  if (edge.a >= 0 && edge.a < slots_.free) {
    equations_.hessian[at(edge.a)].noalias() += edge.j.by_a.transpose() * edge.j.by_a;
    equations_.gradient[at(edge.a)].noalias() += edge.j.by_a.transpose() * edge.r;
  }
  if (edge.b < slots_.free) {
    equations_.hessian[at(edge.b)].noalias() += edge.j.by_b.transpose() * edge.j.by_b;
    equations_.gradient[at(edge.b)].noalias() += edge.j.by_b.transpose() * edge.r;
  }
  return edge.robust ? Huber{options_.edge_loss}.cost(squared) : 0.5 * squared;
}

double BundleRound::linearise(const BundleState& state) {
  double sum = 0.0;
  for (std::size_t slot = 0; slot < slots_.pose.size(); ++slot) sum += linearise_slot(slot, state);
  for (RoundEdge& edge : equations_.edges) sum += linearise_edge(edge, state);

  // Several poses see a landmark, so it is summed last
  equations_.points.sum();
  equations_.lines.sum();
  return sum;
}

void NormalEquations::set_scales() {
  for (std::size_t i = 0; i < hessian.size(); ++i) damping[i].set_scale(hessian[i].diagonal());
  points.set_scales();
  lines.set_scales();
}

void NormalEquations::set_damping() {
  for (std::size_t i = 0; i < hessian.size(); ++i) damping[i].set_diagonal(hessian[i].diagonal());
  points.set_damping();
  lines.set_damping();
}

double NormalEquations::largest_gradient() const {
  double largest = 0.0;
  for (const Vector6d& g : gradient) largest = std::max(largest, g.cwiseAbs().maxCoeff());
  for (const Eigen::Vector3d& g : points.gradient) largest = std::max(largest, g.cwiseAbs().maxCoeff());
  for (const Eigen::Vector4d& g : lines.gradient) largest = std::max(largest, g.cwiseAbs().maxCoeff());
  return largest;
}

}  // namespace plumbline::optimize
