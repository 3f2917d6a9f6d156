// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/geometry/alignment.hpp"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <stdexcept>

namespace plumbline::geometry {

Rigid3 align_points(const std::vector<Eigen::Vector3d>& source, const std::vector<Eigen::Vector3d>& target) {
  if (source.size() != target.size()) throw std::invalid_argument("align_points: sizes differ");
  if (source.empty()) return {};

  const auto n = static_cast<Eigen::Index>(source.size());
  Eigen::Matrix3Xd a(3, n);
  Eigen::Matrix3Xd b(3, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    a.col(i) = source[static_cast<std::size_t>(i)];
    b.col(i) = target[static_cast<std::size_t>(i)];
  }

  if (n < 3) return {Eigen::Matrix3d::Identity(), (b.rowwise().mean() - a.rowwise().mean()).eval()};
  const Eigen::Vector3d a_mean = a.rowwise().mean();
  const Eigen::Vector3d b_mean = b.rowwise().mean();

  const Eigen::JacobiSVD<Eigen::Matrix3d> svd((b.colwise() - b_mean) * (a.colwise() - a_mean).transpose(),
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  if (svd.singularValues()(1) <= 1e-9 * svd.singularValues()(0)) {
    // On one line (or in one point) the turn about it is free: the smallest rotation from line to line.
    Eigen::Matrix3d r = Eigen::Matrix3d::Identity();
    if (svd.singularValues()(0) > 0.0) {
      r = Eigen::Quaterniond::FromTwoVectors(svd.matrixV().col(0), svd.matrixU().col(0)).toRotationMatrix();
    }
    return {r, b_mean - r * a_mean};
  }

  const Eigen::Matrix4d t = Eigen::umeyama(a, b, false);
  return {t.topLeftCorner<3, 3>(), t.topRightCorner<3, 1>()};
}

Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& m) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(m, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double handed = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0 ? -1.0 : 1.0;
  return svd.matrixU() * Eigen::Vector3d(1.0, 1.0, handed).asDiagonal() * svd.matrixV().transpose();
}

ScaledRigid3 align_points_scaled(const std::vector<Eigen::Vector3d>& source,
                                 const std::vector<Eigen::Vector3d>& target) {
  ScaledRigid3 result;
  result.rigid = align_points(source, target);  // the best rotation does not depend on the scale
  if (source.empty()) return result;

  // Centroids of both point sets.
  Eigen::Vector3d source_mean = Eigen::Vector3d::Zero();
  Eigen::Vector3d target_mean = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < source.size(); ++i) {
    source_mean += source[i] / static_cast<double>(source.size());
    target_mean += target[i] / static_cast<double>(source.size());
  }

  // Least squares of the scale, with the rotation given.
  double common = 0.0;
  double spread = 0.0;
  for (std::size_t i = 0; i < source.size(); ++i) {
    const Eigen::Vector3d way = source[i] - source_mean;
    common += (target[i] - target_mean).dot(result.rigid.rotation * way);
    spread += way.squaredNorm();
  }

  if (spread > 0.0) result.scale = common / spread;
  result.rigid.translation = target_mean - result.scale * (result.rigid.rotation * source_mean);
  return result;
}

}  // namespace plumbline::geometry
