// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Residuals of bundle adjustment and their derivatives by the local coordinates: poses <- Exp(rho, phi) pose,
// points by addition, lines U <- U Exp(theta), W <- W R(phi) (docs/method/least_squares.md). All in standard
// deviations. Points: pose_terms.
#include <Eigen/Core>

#include "plumbline/geometry/plucker.hpp"
#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/optimize/bundle_adjustment.hpp"
#include "plumbline/optimize/pose_terms.hpp"

namespace plumbline::optimize {

/// Squared error of a point behind the camera: constant, and so large that the gate rejects it.
constexpr double kBehind = 2e6;

/// Measurement of a point as a term; the point's position in the world is not filled in.
PointTerm to_term(const BundlePointObservation& o);

/// Quantities of the camera for a line's observation.
struct LineView {
  LineView(const BundleLineObservation& seen, const sensor::Pinhole& camera);
  Eigen::Vector2d start;
  Eigen::Vector2d end;
  double pixel_weight;
  bool has_depth;
  Eigen::Vector3d start_camera;
  Eigen::Vector3d end_camera;
  double start_weight;
  double end_weight;
  Eigen::Vector3d plane;  ///< unit normal of the plane of camera and segment
};

struct LineDerivatives {
  Eigen::Matrix<double, 4, 6> by_pose;
  Eigen::Matrix<double, 4, 4> by_line;
};

/// Image: e_l = (s1.l, s2.l) / sqrt(l1^2 + l2^2) / sigma, l = K_L n_c; zero for a line without an image.
/// Depth: a measured 3D endpoint p off the line by p x v - n; of that the part within the plane of camera and
/// segment, m.(p x v - n) / sigma_d, m the plane's unit normal (the rest is what the image residual says).
Eigen::Vector4d line_rows(const LineView& seen, const Eigen::Matrix3d& projection,
                          const geometry::Rigid3& camera_from_world, const geometry::OrthonormalLine& line,
                          LineDerivatives* derivatives);

/// e = L^T log( T_b T_a^-1 Z^-1 ), Z the measured b_from_a, L L^T its information.
/// With E = T_b T_a^-1 Z^-1 = Exp(e): left perturbations give Exp(xi_b) E and E Z Exp(-xi_a) Z^-1... so
/// de/dxi_b = J_l^-1(e), de/dxi_a = -J_l^-1(e) Ad(T_b T_a^-1); J_l^-1 is taken to first order, I - ad(e)/2.
struct EdgeView {
  explicit EdgeView(const BundleEdge& edge);
  geometry::Rigid3 a_from_b;
  geometry::Matrix6d root;  ///< L^T
};

struct EdgeDerivatives {
  geometry::Matrix6d by_a;
  geometry::Matrix6d by_b;
};

geometry::Vector6d edge_rows(const EdgeView& edge, const geometry::Rigid3& a_from_world,
                             const geometry::Rigid3& b_from_world, EdgeDerivatives* derivatives);

/// L with L L^T = information, which may be singular: small and negative eigenvalues are set to zero.
geometry::Matrix6d square_root(const geometry::Matrix6d& information);

}  // namespace plumbline::optimize
