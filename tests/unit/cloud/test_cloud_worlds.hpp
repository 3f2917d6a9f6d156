// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Small worlds whose geometry is known.
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <Eigen/Core>
#include <cmath>
#include <fstream>
#include <iterator>
#include <opencv2/core/mat.hpp>
#include <random>
#include <string>

#include "plumbline/cloud/types.hpp"
#include "plumbline/sensor/camera.hpp"
#include "plumbline/sensor/depth_noise.hpp"
#include "plumbline/sensor/frame.hpp"

namespace plumbline::cloud::worlds {

inline sensor::Pinhole camera() { return {640, 480, 525.0, 525.0, 319.5, 239.5}; }

/// Depth of the plane normal . p = distance, metres; with `noise` times the sensor's noise, in steps of
/// disparity as structured light has them.
inline cv::Mat plane_depth(const Eigen::Vector3d& normal, double distance, double noise, unsigned seed = 7,
                           const sensor::Pinhole& pinhole = camera()) {
  std::mt19937 random(seed);
  std::normal_distribution<double> gauss(0.0, noise);
  cv::Mat depth(pinhole.height, pinhole.width, CV_32FC1, cv::Scalar(0));
  for (int v = 0; v < depth.rows; ++v) {
    for (int u = 0; u < depth.cols; ++u) {
      const double z = distance / normal.dot(pinhole.unproject(u, v, 1.0));
      if (!(z > 0.0)) continue;
      depth.at<float>(v, u) = static_cast<float>(z + sensor::depth_sigma(z) * gauss(random));
    }
  }
  return depth;
}

inline sensor::RgbdFrame frame_of(const cv::Mat& depth, const cv::Scalar& bgr = cv::Scalar(10, 20, 30)) {
  sensor::RgbdFrame frame;
  frame.depth = depth;
  frame.color = cv::Mat(depth.size(), CV_8UC3, bgr);
  return frame;
}

inline Point point(float x, float y, float z, const Eigen::Vector3f& normal = {0, 0, -1},
                   std::uint8_t gray = 100) {
  Point p;
  p.x = x;
  p.y = y;
  p.z = z;
  p.normal_x = normal.x();
  p.normal_y = normal.y();
  p.normal_z = normal.z();
  p.r = p.g = p.b = gray;
  p.a = 255;
  return p;
}

inline std::size_t finite_points(const Cloud& cloud) {
  std::size_t count = 0;
  for (const Point& p : cloud.points) {
    count += std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z) ? 1U : 0U;
  }
  return count;
}

inline std::string slurp(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace plumbline::cloud::worlds
