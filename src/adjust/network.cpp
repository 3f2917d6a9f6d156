// SPDX-License-Identifier: BSD-3-Clause
#include "network.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace plumbline::adjust {
namespace {

using geometry::Rigid3;

constexpr Eigen::Index kUnknowns = 7;  // logarithm of scale, rotation, translation

/// Directions in which an observation is of the difference of its two places, or of its one.
Eigen::MatrixXd rows_of(const Control& control, const Eigen::Vector3d& way) {
  switch (control.kind) {
    case ControlKind::kLength:
      return way.normalized().transpose();
    case ControlKind::kLevel:
      return Eigen::RowVector3d::UnitZ();
    case ControlKind::kPlumb:
      return Eigen::Matrix<double, 2, 3>::Identity();
    case ControlKind::kPoint:
      break;
  }

  return Eigen::Matrix3d::Identity();
}

/// Standard deviations of what is not known of a similarity before; tiny: it stays.
Eigen::VectorXd prior_of(const std::vector<Control>& control, const std::vector<std::size_t>& used) {
  std::array<int, 4> counts{};
  for (const std::size_t i : used) ++counts[static_cast<std::size_t>(control[i].kind)];
  const auto count = [&](ControlKind kind) { return counts[static_cast<std::size_t>(kind)]; };
  const int points = count(ControlKind::kPoint);

  constexpr double kNone = 1e-9;
  Eigen::VectorXd sigma = Eigen::VectorXd::Constant(kUnknowns, kNone);
  if (count(ControlKind::kLength) > 0 || points > 1) sigma(0) = 0.2;
  if (count(ControlKind::kLevel) + count(ControlKind::kPlumb) > 0 || points > 2)
    sigma.segment<2>(1).setConstant(0.05);
  if (points > 1) sigma(3) = 0.5;
  if (points > 0) sigma.tail<3>().setConstant(10.0);
  return sigma;
}

}  // namespace

Network::Network(const std::vector<Control>& control, const std::vector<PlaceViews>& p,
                 const std::vector<PlaceViews>& q, const maps::Map& map, const Rigid3& output_from_map)
    : control_(control), p_(p), q_(q) {
  for (const std::vector<PlaceViews>* all : {&p_, &q_}) {
    for (const PlaceViews& place_views : *all) {
      for (const auto& [id, in_camera] : place_views)
        output_from_camera_[id] = output_from_map * map.camera_from_world(id).inverse();
    }
  }
}

Eigen::Vector3d Network::place(const PlaceViews& place_views) const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& [id, in_camera] : place_views) sum += output_from_camera_.at(id) * in_camera;
  return sum / static_cast<double>(std::max<std::size_t>(1, place_views.size()));
}

void Network::move(const Similarity& step) {
  for (auto& [id, pose] : output_from_camera_)
    pose = Rigid3(step.motion.rotation * pose.rotation, step * pose.translation);
  for (std::vector<PlaceViews>* all : {&p_, &q_}) {
    for (PlaceViews& place_views : *all) {
      for (auto& [id, in_camera] : place_views) in_camera *= step.scale;
    }
  }
}

Eigen::VectorXd Network::residual(std::size_t i, const std::vector<Eigen::Vector3d>& targets) const {
  const Eigen::Vector3d p = place(p_[i]);
  if (!control_[i].pair()) return targets[i] - p;
  const Eigen::Vector3d way = p - place(q_[i]);
  if (control_[i].kind == ControlKind::kLength)
    return Eigen::VectorXd::Constant(1, control_[i].length_m - way.norm());
  return -rows_of(control_[i], way) * way;
}

/// Adds the derivative of `rows` times a place, by the keyframes' motions (as rows' columns) and a
/// similarity.
void Network::differentiate(const PlaceViews& place_views, const Eigen::MatrixXd& rows,
                            const MapCovariance& covariance, Eigen::Ref<Eigen::MatrixXd> signal,
                            Eigen::Ref<Eigen::MatrixXd> similarity) const {
  const Eigen::Vector3d p = place(place_views);
  Eigen::Matrix<double, 3, kUnknowns> moves;
  moves << p, -geometry::skew(p), Eigen::Matrix3d::Identity();
  similarity += rows * moves;

  for (const auto& [id, in_camera] : place_views) {
    Eigen::Matrix<double, 3, 6> by_pose;
    by_pose << Eigen::Matrix3d::Identity(), -geometry::skew(in_camera);
    const Eigen::MatrixXd of_rows = rows * output_from_camera_.at(id).rotation * by_pose;
    signal.middleRows<6>(covariance.at(id)) -= of_rows.transpose() / static_cast<double>(place_views.size());
  }
}

Network::Solved Network::solve(const std::vector<bool>& left_out, const std::vector<Eigen::Vector3d>& targets,
                               const MapCovariance& covariance) const {
  Solved solved;
  CollocationProblem problem;
  std::vector<Eigen::VectorXd> residuals;
  Eigen::Index count = 0;

  for (std::size_t i = 0; i < control_.size(); ++i) {
    if (left_out[i]) continue;
    solved.used.push_back(i);
    residuals.push_back(residual(i, targets));
    problem.rows.push_back(static_cast<int>(residuals.back().size()));
    count += residuals.back().size();
  }

  problem.r.resize(count);
  problem.g = Eigen::MatrixXd::Zero(count, kUnknowns);
  Eigen::VectorXd noise(count);
  Eigen::MatrixXd by_keyframes = Eigen::MatrixXd::Zero(covariance.size(), count);

  // Each observation by the similarity and by the poses of the keyframes that saw its places.
  Eigen::Index first = 0;
  for (std::size_t k = 0; k < solved.used.size(); ++k) {
    const std::size_t i = solved.used[k];
    const Control& control = control_[i];
    const Eigen::Index rows = residuals[k].size();

    problem.r.segment(first, rows) = residuals[k];
    noise.segment(first, rows).setConstant(control.sigma_m * control.sigma_m);
    const Eigen::MatrixXd own =
        rows_of(control, place(p_[i]) - (control.pair() ? place(q_[i]) : Eigen::Vector3d::Zero()));
    auto signal = by_keyframes.middleCols(first, rows);
    auto similarity = problem.g.middleRows(first, rows);
    differentiate(p_[i], own, covariance, signal, similarity);
    if (control.pair()) differentiate(q_[i], -own, covariance, signal, similarity);
    first += rows;
  }

  // The map's own uncertainty is noise of the observations here; the similarity is what explains all of them.
  solved.signal = covariance.times(by_keyframes);
  problem.covariance = by_keyframes.transpose() * solved.signal;
  problem.covariance.diagonal() += noise;
  problem.prior_sigma = prior_of(control_, solved.used);
  solved.solution = solve_collocation(problem);

  const Eigen::VectorXd& q = solved.solution.q;
  solved.step.scale = std::exp(q(0));
  solved.step.motion = Rigid3(geometry::exp_so3(q.segment<3>(1)), q.tail<3>());
  if (problem.prior_sigma(0) > 1e-6) solved.scale_sigma = std::sqrt(solved.solution.q_covariance(0, 0));
  return solved;
}

}  // namespace plumbline::adjust
