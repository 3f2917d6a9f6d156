// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Residuals of one camera pose and their Jacobians under the left perturbation
// camera_from_world <- Exp(rho, phi) camera_from_world (docs/method/least_squares.md). All residuals are in
// units of their own standard deviation.
#include <Eigen/Core>

#include "plumbline/geometry/plucker.hpp"
#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/sensor/camera.hpp"

namespace plumbline::optimize {

/// A map point seen as a corner.
struct PointTerm {
  Eigen::Vector3d world = Eigen::Vector3d::Zero();  ///< metres
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  ///< measured
  double pixel_sigma = 1.0;
  double depth = 0.0;        ///< measured, metres; 0: none
  double depth_sigma = 1.0;  ///< metres
};

/// A map line seen as a segment.
struct LineTerm {
  geometry::PluckerLine world;
  Eigen::Vector2d start = Eigen::Vector2d::Zero();  ///< measured endpoints, pixels
  Eigen::Vector2d end = Eigen::Vector2d::Zero();
  double pixel_sigma = 1.0;
};

/// A measured surface point on the tangent plane of the map's surface.
struct PlaneTerm {
  Eigen::Vector3d camera = Eigen::Vector3d::Zero();   ///< measured, camera frame, metres
  Eigen::Vector3d world = Eigen::Vector3d::Zero();    ///< on the map's surface
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< of the map's surface, world frame, unit
  double sigma = 0.01;                                ///< metres, along the normal
};

using Row6 = Eigen::Matrix<double, 1, 6>;

/// (u, v, z) residuals; returns how many rows are valid: 0 (behind the camera), 2 (no depth) or 3.
/// e_p = (u - pi(T P)) / sigma, e_z = (z - (T P)_z) / sigma_z.
int point_residual(const PointTerm& term, const geometry::Rigid3& camera_from_world,
                   const sensor::Pinhole& camera, Eigen::Vector3d& residual,
                   Eigen::Matrix<double, 3, 6>* jacobian);

/// Distances of both measured endpoints from the projected line; false when the line has no image (it passes
/// through the camera's centre). e_l = (s1.l, s2.l) / sqrt(l1^2 + l2^2), l = K_L n_c.
bool line_residual(const LineTerm& term, const geometry::Rigid3& camera_from_world,
                   const Eigen::Matrix3d& projection, Eigen::Vector2d& residual,
                   Eigen::Matrix<double, 2, 6>* jacobian);

/// e = n.(T^-1 p_c - p_m) / sigma.
double plane_residual(const PlaneTerm& term, const geometry::Rigid3& camera_from_world, Row6* jacobian);

}  // namespace plumbline::optimize
