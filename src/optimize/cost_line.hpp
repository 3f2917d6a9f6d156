// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Image: e_l = (s1.l, s2.l) / sqrt(l1^2 + l2^2) / sigma, l = K_L n_c (METHOD section 2).
// Depth: a measured 3D endpoint p off the line by p x v - n; of that the part within the plane of camera and
// segment, m.(p x v - n) / sigma_d, m the plane's unit normal (the rest is what the image residual says).
#include <ceres/sized_cost_function.h>

#include "manifolds.hpp"
#include "plumbline/optimize/bundle_adjustment.hpp"

namespace plumbline::optimize {

class LineCost : public ceres::SizedCostFunction<4, 7, 6> {
 public:
  LineCost(const BundleLineObservation& seen, const sensor::Pinhole& camera)
      : seen_(seen),
        projection_(geometry::line_projection(camera.fx, camera.fy, camera.cx, camera.cy)),
        plane_(camera.unproject(seen.start.x(), seen.start.y(), 1.0)
                   .cross(camera.unproject(seen.end.x(), seen.end.y(), 1.0))
                   .normalized()) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const geometry::Rigid3 pose = to_rigid(parameters[0]);
    const geometry::OrthonormalLine orthonormal = to_line(parameters[1]);
    // v of unit length: divide (w1 u1, w2 u2) by w2.
    const double w2 = std::abs(orthonormal.w2) < 1e-9 ? 1e-9 : orthonormal.w2;
    const geometry::PluckerLine world{orthonormal.u.col(0) * (orthonormal.w1 / w2), orthonormal.u.col(1)};
    const geometry::PluckerLine line = geometry::transform(pose, world);

    Eigen::Map<Eigen::Vector4d> residual(residuals);
    Eigen::Matrix<double, 4, 6> by_line = Eigen::Matrix<double, 4, 6>::Zero();  // d residual / d (n_c, v_c)
    const Eigen::Vector3d l = projection_ * line.n;
    const double norm_sq = l.x() * l.x() + l.y() * l.y();
    residual.setZero();
    if (line.n.squaredNorm() > 1e-10 && norm_sq > 1e-6) {  // else it has no image
      image_rows(l, norm_sq, residual, by_line);
    }
    if (seen_.has_depth) {
      depth_row(line, seen_.start_camera, seen_.start_sigma, 2, residual, by_line);
      depth_row(line, seen_.end_camera, seen_.end_sigma, 3, residual, by_line);
    }
    if (jacobians == nullptr) return true;
    if (jacobians[0] != nullptr) {
      Eigen::Matrix<double, 6, 6> by_pose = Eigen::Matrix<double, 6, 6>::Zero();
      by_pose.topLeftCorner<3, 3>() = -geometry::skew(line.v);
      by_pose.topRightCorner<3, 3>() = -geometry::skew(line.n);
      by_pose.bottomRightCorner<3, 3>() = -geometry::skew(line.v);
      Eigen::Map<Eigen::Matrix<double, 4, 7, Eigen::RowMajor>> j(jacobians[0]);
      j.leftCols<6>() = by_line * by_pose;
      j.col(6).setZero();
    }
    if (jacobians[1] != nullptr) {
      Eigen::Matrix<double, 6, 6> by_world =
          Eigen::Matrix<double, 6, 6>::Zero();  // d (n_c, v_c) / d (n_w, v_w)
      by_world.topLeftCorner<3, 3>() = pose.rotation;
      by_world.topRightCorner<3, 3>() = geometry::skew(pose.translation) * pose.rotation;
      by_world.bottomRightCorner<3, 3>() = pose.rotation;
      Eigen::Map<Eigen::Matrix<double, 4, 6, Eigen::RowMajor>> j(jacobians[1]);
      j.leftCols<4>() = by_line * by_world * unit_direction_jacobian(orthonormal, w2);
      j.rightCols<2>().setZero();
    }
    return true;
  }

 private:
  void image_rows(const Eigen::Vector3d& l, double norm_sq, Eigen::Map<Eigen::Vector4d>& residual,
                  Eigen::Matrix<double, 4, 6>& by_line) const {
    const double w = 1.0 / (std::sqrt(norm_sq) * seen_.pixel_sigma);
    const Eigen::Vector3d s[2] = {seen_.start.homogeneous(), seen_.end.homogeneous()};
    for (int i = 0; i < 2; ++i) {
      const double dot = s[i].dot(l);
      residual(i) = w * dot;
      Eigen::RowVector3d by_l = w * s[i].transpose();  // quotient rule
      by_l.x() -= w * dot * l.x() / norm_sq;
      by_l.y() -= w * dot * l.y() / norm_sq;
      by_line.block<1, 3>(i, 0) = by_l * projection_;
    }
  }

  void depth_row(const geometry::PluckerLine& line, const Eigen::Vector3d& p, double sigma, int row,
                 Eigen::Map<Eigen::Vector4d>& residual, Eigen::Matrix<double, 4, 6>& by_line) const {
    residual(row) = plane_.dot(p.cross(line.v) - line.n) / sigma;
    by_line.block<1, 3>(row, 0) = -plane_.transpose() / sigma;
    by_line.block<1, 3>(row, 3) = plane_.cross(p).transpose() / sigma;  // m.(p x v) = (m x p).v
  }

  /// d (n, v)/d(theta, phi) for n = (w1 / w2) u1, v = u2; phi turns W: d(w1/w2)/dphi = -(1 + (w1/w2)^2).
  static Eigen::Matrix<double, 6, 4> unit_direction_jacobian(const geometry::OrthonormalLine& line,
                                                             double w2) {
    const double d = line.w1 / w2;
    Eigen::Matrix<double, 6, 4> j = Eigen::Matrix<double, 6, 4>::Zero();
    j.block<3, 1>(0, 1) = -d * line.u.col(2);
    j.block<3, 1>(0, 2) = d * line.u.col(1);
    j.block<3, 1>(0, 3) = -(1.0 + d * d) * line.u.col(0);
    j.block<3, 1>(3, 0) = line.u.col(2);
    j.block<3, 1>(3, 2) = -line.u.col(0);
    return j;
  }

  BundleLineObservation seen_;
  Eigen::Matrix3d projection_;
  Eigen::Vector3d plane_;
};

}  // namespace plumbline::optimize
