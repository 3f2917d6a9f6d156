// SPDX-License-Identifier: BSD-3-Clause
// KITTI odometry: the first three rows of a 4x4 world_from_camera, 12 numbers a row and no stamps; or all
// four, 16 numbers a row, as Replica's traj.txt has them.
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "trajectories/trajectory_formats.hpp"

namespace plumbline::dataset {
namespace {

constexpr double kMatrixTolerance = 0.01;  // of R^T R against identity

bool is_rotation(const Eigen::Matrix3d& r) {
  return (r.transpose() * r - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < kMatrixTolerance &&
         r.determinant() > 0.0;
}

Eigen::Matrix<double, 3, 4> matrix_of(const std::vector<double>& n) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(n.data());
}

bool all_finite(const std::vector<double>& n) {
  return std::all_of(n.begin(), n.end(), [](double v) { return std::isfinite(v); });
}

bool is_kitti(const TrajectoryText& text) {
  if (text.header) return false;
  for (const TextLine& row : text.rows) {
    if (row.words.size() != 12 && row.words.size() != 16) return false;
    const auto n = text.numbers(row);
    if (!n) return false;

    // Lost poses tell nothing about the format
    if (!all_finite(*n)) continue;
    if (n->size() == 16 && ((*n)[12] != 0.0 || (*n)[13] != 0.0 || (*n)[14] != 0.0 || (*n)[15] != 1.0))
      return false;
    return is_rotation(matrix_of(*n).leftCols<3>());
  }
  return false;
}

core::Result<PoseOfRow> read_kitti(const TrajectoryText& text, const TextLine& row, double& /*stamp*/) {
  if (row.words.size() != 12 && row.words.size() != 16)
    return text.wrong(row.number, "expected 12 numbers, as in the rows above");
  const auto n = text.numbers(row);
  if (!n) return tl::unexpected(n.error());

  // A lost pose keeps its row number
  if (!all_finite(*n)) return PoseOfRow();
  const Eigen::Matrix<double, 3, 4> m = matrix_of(*n);
  if (!is_rotation(m.leftCols<3>())) return text.wrong(row.number, "the matrix is not a rotation");
  const Eigen::Quaterniond q(Eigen::Matrix3d(m.leftCols<3>()));
  return PoseOfRow(geometry::StampedPose{0.0, {q, m.col(3)}});
}

}  // namespace

const TrajectoryFormat kKittiTrajectory = {"KITTI", false, &is_kitti, &read_kitti};

}  // namespace plumbline::dataset
