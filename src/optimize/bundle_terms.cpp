// SPDX-License-Identifier: BSD-3-Clause
#include "bundle_terms.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>

#include "plumbline/geometry/adjoint.hpp"

namespace plumbline::optimize {
namespace {

using geometry::Matrix6d;
using geometry::Rigid3;
using geometry::Vector6d;
using Rows46 = Eigen::Matrix<double, 4, 6>;

/// Two rows of the ends in the image, then two of their depths.
struct LineRows {
  Eigen::Vector4d residual = Eigen::Vector4d::Zero();
  Rows46 by_line = Rows46::Zero();  ///< d residual / d (n_c, v_c)
};

// Distances of a segment's ends from the projected line, with derivatives.
void image_rows(const LineView& seen, const Eigen::Matrix3d& projection, const Eigen::Vector3d& l,
                double norm_sq, LineRows& rows) {
  const double w = seen.pixel_weight / std::sqrt(norm_sq);
  const Eigen::Vector3d s[2] = {seen.start.homogeneous(), seen.end.homogeneous()};
  for (int i = 0; i < 2; ++i) {
    const double dot = s[i].dot(l);
    rows.residual(i) = w * dot;
    Eigen::RowVector3d by_l = w * s[i].transpose();  // quotient rule
    by_l.x() -= w * dot * l.x() / norm_sq;
    by_l.y() -= w * dot * l.y() / norm_sq;
    rows.by_line.block<1, 3>(i, 0).noalias() = by_l * projection;
  }
}

void depth_row(const LineView& seen, const geometry::PluckerLine& line, const Eigen::Vector3d& p,
               double weight, int row, LineRows& rows) {
  rows.residual(row) = weight * seen.plane.dot(p.cross(line.v) - line.n);
  rows.by_line.block<1, 3>(row, 0) = -weight * seen.plane.transpose();
  rows.by_line.block<1, 3>(row, 3) = weight * seen.plane.cross(p).transpose();  // m.(p x v) = (m x p).v
}

/// d (n, v)/d(theta, phi) for n = (w1 / w2) u1, v = u2; phi turns W: d(w1/w2)/dphi = -(1 + (w1/w2)^2).
Eigen::Matrix<double, 6, 4> unit_direction_jacobian(const geometry::OrthonormalLine& line, double w2) {
  const double d = line.w1 / w2;
  Eigen::Matrix<double, 6, 4> j = Eigen::Matrix<double, 6, 4>::Zero();
  j.block<3, 1>(0, 1) = -d * line.u.col(2);
  j.block<3, 1>(0, 2) = d * line.u.col(1);
  j.block<3, 1>(0, 3) = -(1.0 + d * d) * line.u.col(0);
  j.block<3, 1>(3, 0) = line.u.col(2);
  j.block<3, 1>(3, 2) = -line.u.col(0);
  return j;
}

}  // namespace

PointTerm to_term(const BundlePointObservation& o) {
  PointTerm term;
  term.pixel = o.pixel;
  term.pixel_sigma = o.pixel_sigma;
  term.depth = o.depth;
  term.depth_sigma = o.depth_sigma;
  return term;
}

LineView::LineView(const BundleLineObservation& seen, const sensor::Pinhole& camera)
    : start(seen.start),
      end(seen.end),
      pixel_weight(1.0 / seen.pixel_sigma),
      has_depth(seen.has_depth),
      start_camera(seen.start_camera),
      end_camera(seen.end_camera),
      start_weight(1.0 / seen.start_sigma),
      end_weight(1.0 / seen.end_sigma),
      plane(camera.unproject(seen.start.x(), seen.start.y(), 1.0)
                .cross(camera.unproject(seen.end.x(), seen.end.y(), 1.0))
                .normalized()) {}

Eigen::Vector4d line_rows(const LineView& seen, const Eigen::Matrix3d& projection,
                          const Rigid3& camera_from_world, const geometry::OrthonormalLine& orthonormal,
                          LineDerivatives* derivatives) {
  // v of unit length: divide (w1 u1, w2 u2) by w2.
  const double w2 = std::abs(orthonormal.w2) < 1e-9 ? 1e-9 : orthonormal.w2;
  const geometry::PluckerLine world{orthonormal.u.col(0) * (orthonormal.w1 / w2), orthonormal.u.col(1)};
  const geometry::PluckerLine line = geometry::transform(camera_from_world, world);

  LineRows rows;
  const Eigen::Vector3d l = projection * line.n;
  const double norm_sq = l.x() * l.x() + l.y() * l.y();
  if (line.n.squaredNorm() > 1e-10 && norm_sq > 1e-6) image_rows(seen, projection, l, norm_sq, rows);

  if (seen.has_depth) {
    depth_row(seen, line, seen.start_camera, seen.start_weight, 2, rows);
    depth_row(seen, line, seen.end_camera, seen.end_weight, 3, rows);
  }

  if (derivatives == nullptr) return rows.residual;
  const auto by_n = rows.by_line.leftCols<3>();
  const auto by_v = rows.by_line.rightCols<3>();

  // n_c and v_c by (rho, phi): [-[v]x, -[n]x; 0, -[v]x].
  const Eigen::Matrix3d v = geometry::skew(line.v);
  derivatives->by_pose.leftCols<3>().noalias() = -(by_n * v);
  derivatives->by_pose.rightCols<3>().noalias() = -(by_n * geometry::skew(line.n)) - by_v * v;

  // Derivatives by the line in the world
  Rows46 by_world;  // n_c = R n_w + [t]x R v_w, v_c = R v_w
  by_world.leftCols<3>().noalias() = by_n * camera_from_world.rotation;
  by_world.rightCols<3>().noalias() =
      (by_n * geometry::skew(camera_from_world.translation) + by_v) * camera_from_world.rotation;
  derivatives->by_line.noalias() = by_world * unit_direction_jacobian(orthonormal, w2);
  return rows.residual;
}

Matrix6d square_root(const Matrix6d& information) {
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(information);
  const Vector6d roots = eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt();
  return eigen.eigenvectors() * roots.asDiagonal();
}

EdgeView::EdgeView(const BundleEdge& edge)
    : a_from_b(edge.b_from_a.inverse()), root(square_root(edge.information).transpose()) {}

Vector6d edge_rows(const EdgeView& edge, const Rigid3& a_from_world, const Rigid3& b_from_world,
                   EdgeDerivatives* derivatives) {
  const Rigid3 b_from_a = b_from_world * a_from_world.inverse();
  const Vector6d e = geometry::log_se3(b_from_a * edge.a_from_b);
  if (derivatives != nullptr) {
    // Inverse left Jacobian of SE(3), to first order
    Matrix6d inverse_left = Matrix6d::Identity();
    const Eigen::Matrix3d rho = geometry::skew(e.head<3>());
    const Eigen::Matrix3d phi = geometry::skew(e.tail<3>());
    inverse_left.topLeftCorner<3, 3>() -= 0.5 * phi;
    inverse_left.topRightCorner<3, 3>() -= 0.5 * rho;
    inverse_left.bottomRightCorner<3, 3>() -= 0.5 * phi;
    derivatives->by_b.noalias() = edge.root * inverse_left;
    derivatives->by_a.noalias() = -derivatives->by_b * geometry::adjoint(b_from_a);
  }
  return edge.root * e;
}

}  // namespace plumbline::optimize
