// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Poses and lines as parameter blocks of Ceres, their manifolds, and the residuals of pose_terms and
// bundle_terms as cost functions of Ceres. Cost functions put their derivatives by the local coordinates into
// the first columns of the ambient Jacobian; PlusJacobian = [I; 0] selects these.
#include <ceres/manifold.h>
#include <ceres/problem.h>
#include <ceres/sized_cost_function.h>

#include <algorithm>
#include <cmath>

#include "bundle_terms.hpp"

namespace plumbline::optimize {

/// Options of a problem that does not own its losses and manifolds.
inline ceres::Problem::Options borrowing() {
  ceres::Problem::Options options;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  return options;
}

/// Size of camera_from_world as a block: quaternion x y z w, translation.
constexpr int kPoseBlock = 7;
/// Size of an orthonormal line as a block: quaternion x y z w of U, then w1 w2.
constexpr int kLineBlock = 6;

inline geometry::Rigid3 to_rigid(const double* block) {
  return {Eigen::Quaterniond(Eigen::Map<const Eigen::Quaterniond>(block)),
          Eigen::Vector3d(Eigen::Map<const Eigen::Vector3d>(block + 4))};
}
inline void from_rigid(const geometry::Rigid3& pose, double* block) {
  Eigen::Map<Eigen::Quaterniond> q(block);
  q = pose.quaternion();
  std::copy_n(pose.translation.data(), 3, block + 4);
}
inline geometry::OrthonormalLine to_line(const double* block) {
  const Eigen::Map<const Eigen::Quaterniond> q(block);
  return {q.normalized().toRotationMatrix(), block[4], block[5]};
}
inline void from_line(const geometry::OrthonormalLine& line, double* block) {
  Eigen::Map<Eigen::Quaterniond> q(block);
  q = Eigen::Quaterniond(line.u).normalized();
  block[4] = line.w1;
  block[5] = line.w2;
}

template <int kAmbient, int kTangent>
class LiftedManifold : public ceres::Manifold {
 public:
  int AmbientSize() const override { return kAmbient; }
  int TangentSize() const override { return kTangent; }
  bool PlusJacobian(const double* /*x*/, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, kAmbient, kTangent, Eigen::RowMajor>>(jacobian).setIdentity();
    return true;
  }
  // Ceres' minimisers do not call these, and lifted Jacobians do not define them.
  bool Minus(const double* /*y*/, const double* /*x*/, double* /*y_minus_x*/) const override { return false; }
  bool MinusJacobian(const double* /*x*/, double* /*jacobian*/) const override { return false; }
};

/// Update of a pose: T <- Exp(delta) T.
class PoseManifold : public LiftedManifold<kPoseBlock, 6> {
 public:
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    const Eigen::Map<const geometry::Vector6d> xi(delta);
    from_rigid(geometry::exp_se3(xi) * to_rigid(x), x_plus_delta);
    return true;
  }
};

/// Update of a line: U <- U Exp(theta), W <- W R(phi).
class LineManifold : public LiftedManifold<kLineBlock, 4> {
 public:
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    from_line(geometry::update(to_line(x), Eigen::Vector4d(delta)), x_plus_delta);
    return true;
  }
};

/// Copies a local Jacobian into the first columns of an ambient one, unless that is null.
template <int kAmbient, int kRows, int kTangent>
void lift(const Eigen::Matrix<double, kRows, kTangent>& local, double* jacobian) {
  if (jacobian == nullptr) return;
  Eigen::Map<Eigen::Matrix<double, kRows, kAmbient, Eigen::RowMajor>> j(jacobian);
  j.template leftCols<kTangent>() = local;
  j.template rightCols<kAmbient - kTangent>().setZero();
}

/// Cost of point_residual; the third row is 0 without depth. All costs fail if the result is not finite.
class PointCost : public ceres::SizedCostFunction<3, kPoseBlock, 3> {
 public:
  PointCost(const BundlePointObservation& seen, const sensor::Pinhole& camera)
      : term_(to_term(seen)), camera_(camera) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const geometry::Rigid3 pose = to_rigid(parameters[0]);
    PointTerm term = term_;
    term.world = Eigen::Vector3d(parameters[1]);

    Eigen::Vector3d r;
    Eigen::Matrix<double, 3, 6> j;
    if (point_residual(term, pose, camera_, r, jacobians != nullptr ? &j : nullptr) == 0) {
      // Behind the camera: a constant cost
      r << std::sqrt(kBehind), 0.0, 0.0;
      j.setZero();
    }

    std::copy_n(r.data(), 3, residuals);
    if (jacobians == nullptr) return r.allFinite();
    lift<kPoseBlock>(j, jacobians[0]);
    const Eigen::Matrix3d by_point = j.leftCols<3>() * pose.rotation;  // de/dP = de/drho R
    lift<3>(by_point, jacobians[1]);
    return r.allFinite();
  }

 private:
  PointTerm term_;
  const sensor::Pinhole& camera_;
};

/// Cost of line_rows.
class LineCost : public ceres::SizedCostFunction<4, kPoseBlock, kLineBlock> {
 public:
  LineCost(const BundleLineObservation& seen, const sensor::Pinhole& camera)
      : view_(seen, camera),
        projection_(geometry::line_projection(camera.fx, camera.fy, camera.cx, camera.cy)) {}

  // Errors of the segment's ends, with derivatives by pose and line.
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    LineDerivatives j;
    Eigen::Map<Eigen::Vector4d> r(residuals);
    r = line_rows(view_, projection_, to_rigid(parameters[0]), to_line(parameters[1]),
                  jacobians != nullptr ? &j : nullptr);
    if (jacobians == nullptr) return r.allFinite();
    lift<kPoseBlock>(j.by_pose, jacobians[0]);
    lift<kLineBlock>(j.by_line, jacobians[1]);
    return r.allFinite();
  }

 private:
  LineView view_;
  Eigen::Matrix3d projection_;
};

/// Cost of edge_rows.
class EdgeCost : public ceres::SizedCostFunction<6, kPoseBlock, kPoseBlock> {
 public:
  explicit EdgeCost(const BundleEdge& edge) : view_(edge) {}

  // Error of the relative pose, with derivatives by both poses.
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    EdgeDerivatives j;
    Eigen::Map<geometry::Vector6d> r(residuals);
    r = edge_rows(view_, to_rigid(parameters[0]), to_rigid(parameters[1]),
                  jacobians != nullptr ? &j : nullptr);
    if (jacobians == nullptr) return r.allFinite();
    lift<kPoseBlock>(j.by_a, jacobians[0]);
    lift<kPoseBlock>(j.by_b, jacobians[1]);
    return r.allFinite();
  }

 private:
  EdgeView view_;
};

}  // namespace plumbline::optimize
