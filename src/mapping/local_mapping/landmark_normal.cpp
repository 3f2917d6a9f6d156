// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/landmark_normal.hpp"

#include <algorithm>
#include <cmath>

namespace plumbline::mapping {
namespace {

constexpr double kCell = 32.0;  // pixels

}  // namespace

SurfaceNormals::SurfaceNormals(const std::vector<maps::SurfaceSample>& surface, const sensor::Pinhole& camera)
    : surface_(surface),
      camera_(camera),
      columns_(static_cast<int>(camera.width / kCell) + 1),
      rows_(static_cast<int>(camera.height / kCell) + 1),
      cells_(static_cast<std::size_t>(columns_ * rows_)) {
  for (std::size_t i = 0; i < surface.size(); ++i) {
    const Eigen::Vector2d pixel = camera.project(surface[i].point.cast<double>());
    if (!camera.contains(pixel)) continue;
    const auto cell = static_cast<int>(pixel.y() / kCell) * columns_ + static_cast<int>(pixel.x() / kCell);
    cells_[static_cast<std::size_t>(cell)].push_back(static_cast<int>(i));
  }
}

Eigen::Vector3d SurfaceNormals::at(const Eigen::Vector3d& point) const {
  constexpr double kSigmas = 3.0;
  constexpr double kMinSigma = 0.004;  // m: what the depth of a single corner adds
  constexpr int kMinSamples = 3;
  constexpr double kMinAgreement = 0.95;  // length of the mean of unit vectors: 18 degrees
  if (!(point.z() > 0.0)) return Eigen::Vector3d::Zero();
  const Eigen::Vector2d pixel = camera_.project(point);
  const auto cell = [](double v) { return static_cast<int>(std::floor(v / kCell)); };
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int count = 0;
  for (int r = std::max(0, cell(pixel.y()) - 1); r <= std::min(rows_ - 1, cell(pixel.y()) + 1); ++r) {
    for (int c = std::max(0, cell(pixel.x()) - 1); c <= std::min(columns_ - 1, cell(pixel.x()) + 1); ++c) {
      for (int i : cells_[static_cast<std::size_t>(r * columns_ + c)]) {
        const maps::SurfaceSample& s = surface_[static_cast<std::size_t>(i)];
        const Eigen::Vector3d position = s.point.cast<double>();
        if ((camera_.project(position) - pixel).squaredNorm() > kCell * kCell) continue;
        const Eigen::Vector3d normal = s.normal.cast<double>();
        const double gate = kSigmas * std::max(kMinSigma, static_cast<double>(s.sigma));
        if (std::abs(normal.dot(point - position)) > gate) continue;
        sum += normal;
        ++count;
      }
    }
  }
  if (count < kMinSamples || sum.norm() < kMinAgreement * count) return Eigen::Vector3d::Zero();
  return sum.normalized();
}

}  // namespace plumbline::mapping
