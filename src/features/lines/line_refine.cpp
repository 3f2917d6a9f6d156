// SPDX-License-Identifier: BSD-3-Clause
// Refinement of detected lines: which side is darker, and where within a pixel the edge lies.
#include <array>
#include <cmath>

#include "lines/line_geometry.hpp"

namespace plumbline::features {
namespace {

constexpr int kProfileReach = 3;      // px each side that the profile across a line covers
constexpr float kWindowSigma = 1.3F;  // px; a parallel edge 3 px away must not pull

// Weighted straight-line fit offset(t) = a + b t, t in [-1, 1].
struct OffsetFit {
  float w = 0.0F, wt = 0.0F, wtt = 0.0F, wo = 0.0F, wto = 0.0F;
  void add(float t, float offset, float weight) {
    w += weight;
    wt += weight * t;
    wtt += weight * t * t;
    wo += weight * offset;
    wto += weight * t * offset;
  }
  [[nodiscard]] bool solve(float& a, float& b) const {
    const float det = w * wtt - wt * wt;
    if (!(w > 0.0F) || !(det > 1e-4F * w * w)) return false;
    a = (wtt * wo - wt * wto) / det;
    b = (w * wto - wt * wo) / det;
    return true;
  }
};

int samples_along(float length) { return std::clamp(static_cast<int>(length / 4.0F), 6, 20); }

// Gaussian weights of a profile's samples.
std::array<float, 2 * kProfileReach> window_weights() {
  std::array<float, 2 * kProfileReach> weights{};
  for (int i = 0; i < 2 * kProfileReach; ++i) {
    const float offset = static_cast<float>(i - kProfileReach) + 0.5F;
    weights[static_cast<std::size_t>(i)] = std::exp(-0.5F * offset * offset / (kWindowSigma * kWindowSigma));
  }
  return weights;
}

}  // namespace

void orient(LineSegment& segment, const cv::Mat& gray) {
  const Eigen::Vector2f normal = right_of(segment.direction());
  const int n = std::clamp(static_cast<int>(segment.length() / 6.0F), 4, 12);
  float sum = 0.0F;
  for (int k = 0; k < n; ++k) {
    const float s = (static_cast<float>(k) + 0.5F) / static_cast<float>(n);
    const Eigen::Vector2f p = segment.start + s * (segment.end - segment.start);
    const Eigen::Vector2f left = p - 1.5F * normal;
    const Eigen::Vector2f right = p + 1.5F * normal;
    sum += bilinear(gray, left.x(), left.y()) - bilinear(gray, right.x(), right.y());
  }

  // The darker side is on the right
  const float step = sum / (3.0F * static_cast<float>(n));
  if (step < 0.0F) std::swap(segment.start, segment.end);
  segment.response = std::abs(step);
}

void refine(LineSegment& segment, const cv::Mat& gray) {
  static const std::array<float, 2 * kProfileReach> weights = window_weights();
  const int n = samples_along(segment.length());

  for (int pass = 0; pass < 2; ++pass) {
    const Eigen::Vector2f normal = right_of(segment.direction());
    OffsetFit fit;
    for (int k = 0; k < n; ++k) {
      const float s = (static_cast<float>(k) + 0.5F) / static_cast<float>(n);
      const Eigen::Vector2f p = segment.start + s * (segment.end - segment.start);
      Eigen::Vector2f q = p - static_cast<float>(kProfileReach) * normal;
      float before = bilinear(gray, q.x(), q.y());
      float total = 0.0F;
      float sum = 0.0F;

      float moment = 0.0F;
      for (int i = 0; i < 2 * kProfileReach; ++i) {
        q += normal;
        const float after = bilinear(gray, q.x(), q.y());
        // Only steps from bright (left) to dark (right) belong to this line. Walls darken towards their
        // corners, on one side of an edge: squared, these small steps hardly pull.
        const float step = std::max(0.0F, before - after);

        const float windowed = weights[static_cast<std::size_t>(i)] * step;
        const float w = windowed * step;
        total += windowed;
        sum += w;
        moment += w * (static_cast<float>(i - kProfileReach) + 0.5F);
        before = after;
      }

      // Saturating weight: one strong spot must not outvote the rest of the line.
      if (total > 0.5F) fit.add(2.0F * s - 1.0F, moment / sum, std::min(total, 20.0F));
    }

    // Both ends move across the line
    float a = 0.0F;
    float b = 0.0F;
    if (!fit.solve(a, b) || std::abs(a) + std::abs(b) > static_cast<float>(kProfileReach)) return;
    segment.start += (a - b) * normal;
    segment.end += (a + b) * normal;
  }
}

void sort_segments(std::vector<LineSegment>& segments) {
  const auto key = [](const LineSegment& s) {
    return std::make_tuple(-(s.end - s.start).squaredNorm(), s.start.y(), s.start.x(), s.end.y(), s.end.x());
  };
  std::sort(segments.begin(), segments.end(),
            [&](const LineSegment& a, const LineSegment& b) { return key(a) < key(b); });
}

}  // namespace plumbline::features
