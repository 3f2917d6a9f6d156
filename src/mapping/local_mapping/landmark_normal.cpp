// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/local_mapping/landmark_normal.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "plumbline/sensor/depth_noise.hpp"

namespace plumbline::mapping {
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
