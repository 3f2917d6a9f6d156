// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/geometry/alignment.hpp"

#include <Eigen/Geometry>
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
  const Eigen::Matrix4d t = Eigen::umeyama(a, b, false);
  return {t.topLeftCorner<3, 3>(), t.topRightCorner<3, 1>()};
}

}  // namespace plumbline::geometry
