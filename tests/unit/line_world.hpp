// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Pictures of flat polygons whose edges are known exactly, for tests and benchmarks of lines.
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <random>
#include <vector>

#include "plumbline/features/line_segment.hpp"

namespace plumbline::features::world {

inline LineSegment segment(float x0, float y0, float x1, float y1) {
  LineSegment s;
  s.start = {x0, y0};
  s.end = {x1, y1};
  s.response = 10.0F;
  return s;
}

/// Convex, corners clockwise on the screen, pixels (centre convention).
struct Polygon {
  std::vector<Eigen::Vector2d> corners;
  double gray = 128.0;
};

inline double uniform(std::mt19937& random, double low, double high) {
  return low + (high - low) * (static_cast<double>(random()) / 4294967296.0);
}

inline bool contains(const Polygon& polygon, double x, double y) {
  for (std::size_t i = 0; i < polygon.corners.size(); ++i) {
    const Eigen::Vector2d& a = polygon.corners[i];
    const Eigen::Vector2d& b = polygon.corners[(i + 1) % polygon.corners.size()];
    if ((b.x() - a.x()) * (y - a.y()) - (b.y() - a.y()) * (x - a.x()) < 0.0) return false;
  }
  return true;
}

/// Later polygons cover earlier ones; every pixel is the mean of 4 x 4 samples over its area.
inline cv::Mat render(int width, int height, double background, const std::vector<Polygon>& polygons) {
  constexpr int kSub = 4;
  cv::Mat fine(height * kSub, width * kSub, CV_32F, cv::Scalar(background));
  for (const Polygon& polygon : polygons) {
    Eigen::Vector2d low = polygon.corners[0];
    Eigen::Vector2d high = low;
    for (const Eigen::Vector2d& c : polygon.corners) {
      low = low.cwiseMin(c);
      high = high.cwiseMax(c);
    }
    const int y0 = std::clamp(static_cast<int>((low.y() - 1.0) * kSub), 0, fine.rows);
    const int y1 = std::clamp(static_cast<int>((high.y() + 2.0) * kSub), 0, fine.rows);
    const int x0 = std::clamp(static_cast<int>((low.x() - 1.0) * kSub), 0, fine.cols);
    const int x1 = std::clamp(static_cast<int>((high.x() + 2.0) * kSub), 0, fine.cols);
    for (int y = y0; y < y1; ++y) {
      for (int x = x0; x < x1; ++x) {
        // Sample centres: pixel p covers [p - 0.5, p + 0.5].
        if (contains(polygon, (x + 0.5) / kSub - 0.5, (y + 0.5) / kSub - 0.5)) {
          fine.at<float>(y, x) = static_cast<float>(polygon.gray);
        }
      }
    }
  }
  cv::Mat image;
  cv::resize(fine, image, cv::Size(width, height), 0.0, 0.0, cv::INTER_AREA);
  image.convertTo(image, CV_8U);
  return image;
}

/// Adds Gaussian noise, gain and offset; deterministic.
inline cv::Mat disturb(const cv::Mat& image, double sigma, double gain, double offset, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0.0, sigma);
  cv::Mat result = image.clone();
  for (int y = 0; y < result.rows; ++y) {
    for (int x = 0; x < result.cols; ++x) {
      const double value =
          gain * image.at<unsigned char>(y, x) + offset + (sigma > 0.0 ? noise(random) : 0.0);
      result.at<unsigned char>(y, x) = cv::saturate_cast<unsigned char>(value);
    }
  }
  return result;
}

/// Many overlapping quadrilaterals of random place, size, turn and grey value.
inline std::vector<Polygon> clutter(int count, int width, int height, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<Polygon> polygons;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector2d centre(uniform(random, 0.0, width), uniform(random, 0.0, height));
    const double half_width = uniform(random, 12.0, 90.0);
    const double half_height = uniform(random, 8.0, 60.0);
    const double turn = uniform(random, 0.0, 3.14);
    Polygon polygon;
    polygon.gray = uniform(random, 20.0, 235.0);
    for (const auto& [sx, sy] : {std::pair{-1.0, -1.0}, {1.0, -1.0}, {1.0, 1.0}, {-1.0, 1.0}}) {
      const Eigen::Vector2d p(sx * half_width, sy * half_height);
      polygon.corners.emplace_back(centre.x() + std::cos(turn) * p.x() - std::sin(turn) * p.y(),
                                   centre.y() + std::sin(turn) * p.x() + std::cos(turn) * p.y());
    }
    polygons.push_back(polygon);
  }
  return polygons;
}

inline Eigen::Vector2d warp(const Eigen::Matrix3d& homography, const Eigen::Vector2d& p) {
  return (homography * p.homogeneous()).hnormalized();
}

inline std::vector<Polygon> warp(const Eigen::Matrix3d& homography, std::vector<Polygon> polygons) {
  for (Polygon& polygon : polygons) {
    for (Eigen::Vector2d& c : polygon.corners) c = warp(homography, c);
  }
  return polygons;
}

/// Rotation and scale about the image's middle, shift, and a little perspective.
inline Eigen::Matrix3d view_change(int width, int height, double angle, double scale, double perspective) {
  Eigen::Matrix3d to_middle = Eigen::Matrix3d::Identity();
  to_middle(0, 2) = -0.5 * width;
  to_middle(1, 2) = -0.5 * height;
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  turn << scale * std::cos(angle), -scale * std::sin(angle), 6.0, scale * std::sin(angle),
      scale * std::cos(angle), -4.0, perspective / width, 0.5 * perspective / height, 1.0;
  return to_middle.inverse() * turn * to_middle;
}

/// Distance of a point from the infinite line through a and b.
inline double distance(const Eigen::Vector2d& p, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector2d d = (b - a).normalized();
  return std::abs(d.x() * (p.y() - a.y()) - d.y() * (p.x() - a.x()));
}

/// Number of the polygon edge that a segment lies on (both ends within `tolerance` px of it and between its
/// corners), or -1. Unique over all polygons, the same before and after a warp.
inline int edge_of(const LineSegment& segment, const std::vector<Polygon>& polygons, double tolerance = 1.0) {
  int number = 0;
  int best = -1;
  double nearest = tolerance;
  const Eigen::Vector2d s = segment.start.cast<double>();
  const Eigen::Vector2d e = segment.end.cast<double>();
  for (const Polygon& polygon : polygons) {
    for (std::size_t i = 0; i < polygon.corners.size(); ++i, ++number) {
      const Eigen::Vector2d& a = polygon.corners[i];
      const Eigen::Vector2d& b = polygon.corners[(i + 1) % polygon.corners.size()];
      const double length = (b - a).norm();
      const Eigen::Vector2d d = (b - a) / length;
      const double far = std::max(distance(s, a, b), distance(e, a, b));
      const auto between = [&](const Eigen::Vector2d& p) {
        return d.dot(p - a) > -4.0 && d.dot(p - a) < length + 4.0;
      };
      if (far < nearest && between(s) && between(e)) {
        nearest = far;
        best = number;
      }
    }
  }
  return best;
}

}  // namespace plumbline::features::world
