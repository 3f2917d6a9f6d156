// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/optimize/pose_terms.hpp"

#include <cmath>

namespace plumbline::optimize {
namespace {

constexpr double kMinDepth = 0.05;  // metres; nearer points are behind or inside the camera

}  // namespace

int point_residual(const PointTerm& term, const geometry::Rigid3& camera_from_world,
                   const sensor::Pinhole& camera, Eigen::Vector3d& residual,
                   Eigen::Matrix<double, 3, 6>* jacobian) {
  const Eigen::Vector3d p = camera_from_world * term.world;
  if (p.z() < kMinDepth) return 0;

  // Reprojection error in sigmas
  const double iz = 1.0 / p.z();
  const double x = p.x() * iz;
  const double y = p.y() * iz;
  const double w = 1.0 / term.pixel_sigma;
  residual(0) = w * (term.pixel.x() - (camera.fx * x + camera.cx));
  residual(1) = w * (term.pixel.y() - (camera.fy * y + camera.cy));

  // Depth error, if depth was measured
  const bool has_depth = term.depth > 0.0;
  const double wz = has_depth ? 1.0 / term.depth_sigma : 0.0;
  residual(2) = has_depth ? wz * (term.depth - p.z()) : 0.0;

  // Derivatives by a left perturbation of the pose
  if (jacobian != nullptr) {
    const double a = w * camera.fx;
    const double b = w * camera.fy;
    *jacobian << -a * iz, 0.0, a * x * iz, a * x * y, -a * (1.0 + x * x), a * y,  //
        0.0, -b * iz, b * y * iz, b * (1.0 + y * y), -b * x * y, -b * x,          //
        0.0, 0.0, -wz, -wz * p.y(), wz * p.x(), 0.0;
  }

  return has_depth ? 3 : 2;
}

bool line_residual(const LineTerm& term, const geometry::Rigid3& camera_from_world,
                   const Eigen::Matrix3d& projection, Eigen::Vector2d& residual,
                   Eigen::Matrix<double, 2, 6>* jacobian) {
  const geometry::PluckerLine line = geometry::transform(camera_from_world, term.world);
  const Eigen::Vector3d l = projection * line.n;
  const double norm_sq = l.x() * l.x() + l.y() * l.y();
  if (line.n.squaredNorm() < 1e-8 || norm_sq < 1e-6) return false;

  // Distances of both ends from the projected line
  const double norm = std::sqrt(norm_sq);
  const double w = 1.0 / (norm * term.pixel_sigma);
  const Eigen::Vector3d s[2] = {term.start.homogeneous(), term.end.homogeneous()};
  Eigen::Matrix<double, 3, 6> dn;
  if (jacobian != nullptr) dn << -geometry::skew(line.v), -geometry::skew(line.n);

  for (int i = 0; i < 2; ++i) {
    const double dot = s[i].dot(l);
    residual(i) = w * dot;
    if (jacobian == nullptr) continue;
    Eigen::RowVector3d dl = w * s[i].transpose();  // quotient rule
    dl.x() -= w * dot * l.x() / norm_sq;
    dl.y() -= w * dot * l.y() / norm_sq;
    jacobian->row(i).noalias() = (dl * projection) * dn;
  }

  return true;
}

double plane_residual(const PlaneTerm& term, const geometry::Rigid3& camera_from_world, Row6* jacobian) {
  const double w = 1.0 / term.sigma;
  // World point R^T (p_c - t); its derivative under the left perturbation is [-R^T, R^T [p_c]x].
  const Eigen::Vector3d world =
      camera_from_world.rotation.transpose() * (term.camera - camera_from_world.translation);
  const double residual = w * term.normal.dot(world - term.world);
  if (jacobian != nullptr) {
    const Eigen::Vector3d m = w * (camera_from_world.rotation * term.normal);  // n^T R^T as a column
    jacobian->head<3>() = -m.transpose();
    jacobian->tail<3>() = m.cross(term.camera).transpose();  // m^T [p]x = (m x p)^T
  }
  return residual;
}

}  // namespace plumbline::optimize
