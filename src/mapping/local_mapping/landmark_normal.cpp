// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/landmark_normal.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "plumbline/sensor/depth_noise.hpp"

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

Eigen::Vector3d depth_normal(const cv::Mat& depth, const Eigen::Vector2d& pixel, double z,
                             const sensor::Pinhole& camera) {
  constexpr int kReach = 12;  // px; over fewer the noise of depth tilts the plane
  constexpr int kStep = 3;
  constexpr int kLeast = 24;          // pixels of the 81
  constexpr double kNear = 0.05;      // of the depth: where the search begins
  constexpr double kLeast_m = 0.004;  // of the gate at the end
  const int x = static_cast<int>(std::lround(pixel.x()));
  const int y = static_cast<int>(std::lround(pixel.y()));
  // On a plane inverse depth is affine in the pixels: q(du, dv) = q0 + q1 du + q2 dv.
  Eigen::Vector3d q(1.0 / z, 0.0, 0.0);
  int count = 0;
  int fitting = 0;
  for (const double gate : {kNear * z, 0.5 * kNear * z, std::max(kLeast_m, 3.0 * sensor::depth_sigma(z))}) {
    Eigen::Matrix3d h = Eigen::Matrix3d::Zero();
    Eigen::Vector3d g = Eigen::Vector3d::Zero();
    count = fitting = 0;
    for (int v = std::max(0, y - kReach); v <= std::min(depth.rows - 1, y + kReach); v += kStep) {
      for (int u = std::max(0, x - kReach); u <= std::min(depth.cols - 1, x + kReach); u += kStep) {
        const auto there = static_cast<double>(depth.at<float>(v, u));
        if (!(there > 0.0)) continue;
        ++count;
        const Eigen::Vector3d basis(1.0, u - pixel.x(), v - pixel.y());
        if (std::abs(there * there * (q.dot(basis) - 1.0 / there)) > gate) continue;
        ++fitting;
        h += basis * basis.transpose();
        g += basis / there;
      }
    }
    if (fitting < kLeast) return Eigen::Vector3d::Zero();
    q = h.ldlt().solve(g);
  }
  if (2 * fitting < count || !q.allFinite()) return Eigen::Vector3d::Zero();
  const double at_centre = q(0) + q(1) * (camera.cx - pixel.x()) + q(2) * (camera.cy - pixel.y());
  return -Eigen::Vector3d(q(1) * camera.fx, q(2) * camera.fy, at_centre).normalized();
}

}  // namespace plumbline::mapping
