// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Small helpers shared by the line sources.
#include <algorithm>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "plumbline/features/line_segment.hpp"

namespace plumbline::features {

/// Right-hand normal of a direction (image, y down): towards the darker side of a directed line.
inline Eigen::Vector2f right_of(const Eigen::Vector2f& d) { return {-d.y(), d.x()}; }

/// Bilinear grey value; coordinates are clamped to the image.
inline float bilinear(const cv::Mat& gray, float x, float y) {
  x = std::clamp(x, 0.0F, static_cast<float>(gray.cols - 1));
  y = std::clamp(y, 0.0F, static_cast<float>(gray.rows - 1));
  const int x0 = std::min(static_cast<int>(x), gray.cols - 2);
  const int y0 = std::min(static_cast<int>(y), gray.rows - 2);
  const float a = x - static_cast<float>(x0);
  const float b = y - static_cast<float>(y0);
  const unsigned char* p = gray.ptr<unsigned char>(y0) + x0;
  const unsigned char* q = p + gray.step;
  return (1.0F - b) * ((1.0F - a) * static_cast<float>(p[0]) + a * static_cast<float>(p[1])) +
         b * ((1.0F - a) * static_cast<float>(q[0]) + a * static_cast<float>(q[1]));
}

/// Puts the darker side on the right; response = mean step across the line over +-2 px, per pixel.
void orient(LineSegment& segment, const cv::Mat& gray);

/// Moves the segment across itself onto the centroid of its squared gradient (sub-pixel, full resolution).
void refine(LineSegment& segment, const cv::Mat& gray);

/// Longest first, ties by position: the fixed order of every list of segments.
void sort_segments(std::vector<LineSegment>& segments);

}  // namespace plumbline::features
