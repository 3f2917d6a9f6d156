// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The same bundle adjustment once more, by other means: Ceres with derivatives that it finds by itself,
// unknowns as increments of where they began. To hold our own solver against.
#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "plumbline/optimize/bundle_adjustment.hpp"

namespace plumbline::tests {

template <typename T>
using Vector3 = Eigen::Matrix<T, 3, 1>;

template <typename T>
struct CeresPose {
  Eigen::Matrix<T, 3, 3> rotation;
  Vector3<T> translation;

  CeresPose(const geometry::Rigid3& start, const T* increment) {
    ceres::AngleAxisToRotationMatrix(increment, rotation.data());
    translation = rotation * start.translation + Eigen::Map<const Vector3<T>>(increment + 3);
    rotation = (rotation * start.rotation).eval();
  }
};

struct CeresPoint {
  optimize::BundlePointObservation seen;
  sensor::Pinhole camera;
  geometry::Rigid3 start;
  template <typename T>
  bool operator()(const T* pose, const T* point, T* r) const {
    const CeresPose<T> camera_from_world(start, pose);
    const Vector3<T> p =
        camera_from_world.rotation * Eigen::Map<const Vector3<T>>(point) + camera_from_world.translation;
    r[0] = (seen.pixel.x() - (camera.fx * p.x() / p.z() + camera.cx)) / seen.pixel_sigma;
    r[1] = (seen.pixel.y() - (camera.fy * p.y() / p.z() + camera.cy)) / seen.pixel_sigma;
    r[2] = seen.depth > 0.0 ? (seen.depth - p.z()) / seen.depth_sigma : T(0.0);
    return true;
  }
};

struct CeresLine {
  optimize::BundleLineObservation seen;
  sensor::Pinhole camera;
  geometry::Rigid3 start;
  Eigen::Vector3d foot;       ///< of the line at the start: its point nearest to the origin
  Eigen::Vector3d direction;  ///< unit
  /// Two points of the line, each moved across it.
  template <typename T>
  bool operator()(const T* pose, const T* line, T* r) const {
    const CeresPose<T> camera_from_world(start, pose);
    const Eigen::Vector3d u = direction.unitOrthogonal();
    const Eigen::Vector3d w = direction.cross(u);
    const Vector3<T> a = foot + u * line[0] + w * line[1];
    const Vector3<T> b = foot + direction + u * line[2] + w * line[3];
    const Vector3<T> ca = camera_from_world.rotation * a + camera_from_world.translation;
    const Vector3<T> v = (camera_from_world.rotation * (b - a)).normalized();
    const Vector3<T> n = ca.cross(v);
    const Vector3<T> l = geometry::line_projection(camera.fx, camera.fy, camera.cx, camera.cy).cast<T>() * n;
    const T norm = sqrt(l.x() * l.x() + l.y() * l.y());
    r[0] = (l.x() * seen.start.x() + l.y() * seen.start.y() + l.z()) / (norm * seen.pixel_sigma);
    r[1] = (l.x() * seen.end.x() + l.y() * seen.end.y() + l.z()) / (norm * seen.pixel_sigma);
    r[2] = r[3] = T(0.0);
    if (!seen.has_depth) return true;
    const Eigen::Vector3d plane = camera.unproject(seen.start.x(), seen.start.y(), 1.0)
                                      .cross(camera.unproject(seen.end.x(), seen.end.y(), 1.0))
                                      .normalized();
    r[2] = plane.cast<T>().dot(seen.start_camera.cast<T>().cross(v) - n) / seen.start_sigma;
    r[3] = plane.cast<T>().dot(seen.end_camera.cast<T>().cross(v) - n) / seen.end_sigma;
    return true;
  }
};

/// Without derivatives of the logarithm to first order only: numeric ones.
struct CeresEdge {
  geometry::Rigid3 measured_inverse;
  geometry::Matrix6d root;  ///< of the information: root^T root
  geometry::Rigid3 start_a;
  geometry::Rigid3 start_b;
  bool operator()(const double* a, const double* b, double* r) const {
    const CeresPose<double> pa(start_a, a);
    const CeresPose<double> pb(start_b, b);
    const geometry::Rigid3 b_from_a = geometry::Rigid3(pb.rotation, pb.translation) *
                                      geometry::Rigid3(pa.rotation, pa.translation).inverse();
    Eigen::Map<geometry::Vector6d>(r).noalias() = root * geometry::log_se3(b_from_a * measured_inverse);
    return true;
  }
};

struct CeresCosts {
  double initial = 0.0;
  double final = 0.0;
  int iterations = 0;
};

/// One round with Huber losses, as the options say; poses and points are written back. Information of edges
/// must be diagonal.
inline CeresCosts solve_with_ceres(optimize::BundleProblem& problem, const optimize::BundleOptions& options) {
  using Six = std::array<double, 6>;
  std::vector<Six> poses(problem.poses.size(), Six{});
  std::vector<std::array<double, 4>> lines(problem.lines.size(), std::array<double, 4>{});
  ceres::Problem::Options problem_options;
  problem_options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::HuberLoss point_loss(options.point_loss);
  ceres::HuberLoss line_loss(options.line_loss);
  ceres::HuberLoss edge_loss(options.edge_loss);
  ceres::Problem ceres_problem(problem_options);
  const auto start = [&](int i) { return problem.poses[static_cast<std::size_t>(i)].camera_from_world; };
  const auto block = [&](int i) { return poses[static_cast<std::size_t>(i)].data(); };
  for (const optimize::BundlePointObservation& o : problem.point_observations) {
    ceres_problem.AddResidualBlock(new ceres::AutoDiffCostFunction<CeresPoint, 3, 6, 3>(
                                       new CeresPoint{o, problem.camera, start(o.pose)}),
                                   &point_loss, block(o.pose),
                                   problem.points[static_cast<std::size_t>(o.point)].data());
  }
  for (const optimize::BundleLineObservation& o : problem.line_observations) {
    const geometry::PluckerLine& line = problem.lines[static_cast<std::size_t>(o.line)];
    const Eigen::Vector3d v = line.v.normalized();
    const Eigen::Vector3d foot = v.cross(line.n / line.v.norm());
    ceres_problem.AddResidualBlock(new ceres::AutoDiffCostFunction<CeresLine, 4, 6, 4>(
                                       new CeresLine{o, problem.camera, start(o.pose), foot, v}),
                                   &line_loss, block(o.pose), lines[static_cast<std::size_t>(o.line)].data());
  }
  std::vector<char> held(poses.size(), 0);
  Six world{};
  for (const optimize::BundleEdge& edge : problem.edges) {
    const geometry::Matrix6d root = edge.information.cwiseSqrt();
    ceres_problem.AddResidualBlock(
        new ceres::NumericDiffCostFunction<CeresEdge, ceres::CENTRAL, 6, 6, 6>(
            new CeresEdge{edge.b_from_a.inverse(), root, start(edge.a), start(edge.b)}),
        &edge_loss, block(edge.a), block(edge.b));
    for (const int i : {edge.a, edge.b}) {  // and weakly to where it is
      if (std::exchange(held[static_cast<std::size_t>(i)], 1) != 0) continue;
      if (problem.poses[static_cast<std::size_t>(i)].fixed) continue;
      ceres_problem.AddResidualBlock(
          new ceres::NumericDiffCostFunction<CeresEdge, ceres::CENTRAL, 6, 6, 6>(
              new CeresEdge{start(i).inverse(), geometry::Matrix6d::Identity(), {}, start(i)}),
          nullptr, world.data(), block(i));
      ceres_problem.SetParameterBlockConstant(world.data());
    }
  }
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (problem.poses[i].fixed && ceres_problem.HasParameterBlock(poses[i].data()))
      ceres_problem.SetParameterBlockConstant(poses[i].data());
  }
  ceres::Solver::Options solver;
  solver.linear_solver_type = problem.poses.size() <= 60 ? ceres::DENSE_SCHUR : ceres::SPARSE_SCHUR;
  solver.max_num_iterations = options.max_iterations;
  solver.initial_trust_region_radius = options.first_radius;
  solver.function_tolerance = std::max(options.tolerance, 1e-14);
  solver.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &ceres_problem, &summary);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const CeresPose<double> pose(problem.poses[i].camera_from_world, poses[i].data());
    problem.poses[i].camera_from_world = geometry::Rigid3(pose.rotation, pose.translation);
  }
  return {summary.initial_cost, summary.final_cost, static_cast<int>(summary.iterations.size())};
}

}  // namespace plumbline::tests
