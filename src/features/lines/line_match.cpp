// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/features/line_match.hpp"

#include <algorithm>
#include <cmath>

namespace plumbline::features {
namespace {

struct Shape {
  Eigen::Vector2f direction;
  float length;
};

std::vector<Shape> shapes(const std::vector<LineFeature>& lines) {
  std::vector<Shape> result;
  for (const LineFeature& l : lines) result.push_back({l.segment.direction(), l.segment.length()});
  return result;
}

struct Best {
  int index = -1;
  int first = 257;
  int second = 257;

  // Keeps the best and the second best distance.
  void offer(int i, int distance) {
    if (distance < first) {
      second = first;
      first = distance;
      index = i;
    } else if (distance < second) {
      second = distance;
    }
  }
};

}  // namespace

double overlap(const LineSegment& a, const LineSegment& b) {
  const LineSegment& longer = a.length() >= b.length() ? a : b;
  const LineSegment& shorter = a.length() >= b.length() ? b : a;
  const float length = shorter.length();
  if (!(length > 0.0F)) return 0.0;
  // Projection of the shorter on the longer's axis, as an interval about its middle.
  const Eigen::Vector2f axis = longer.direction();
  const float reach = 0.5F * length * std::abs(axis.dot(shorter.direction()));
  const float at = axis.dot(shorter.middle() - longer.middle());
  const float half = 0.5F * longer.length();
  const float common = std::min(half, at + reach) - std::max(-half, at - reach);
  return std::clamp(static_cast<double>(common / length), 0.0, 1.0);
}

std::vector<LineMatch> match_lines(const std::vector<LineFeature>& a, const std::vector<LineFeature>& b,
                                   const LineMatchOptions& options) {
  const auto min_cosine = static_cast<float>(std::cos(options.max_angle_rad));
  const auto min_ratio = static_cast<float>(options.min_length_ratio);
  const auto alike = [&](const Shape& one, const Shape& other) {
    const auto [shorter, longer] = std::minmax(one.length, other.length);
    return one.direction.dot(other.direction) >= min_cosine && shorter >= min_ratio * longer;
  };

  const std::vector<Shape> shapes_a = shapes(a);
  const std::vector<Shape> shapes_b = shapes(b);
  std::vector<Best> best_a(a.size());
  std::vector<Best> best_b(b.size());

  // Best and second best, for both sides
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t j = 0; j < b.size(); ++j) {
      if (!alike(shapes_a[i], shapes_b[j])) continue;
      const int distance = hamming(a[i].descriptor, b[j].descriptor);
      best_a[i].offer(static_cast<int>(j), distance);
      best_b[j].offer(static_cast<int>(i), distance);
    }
  }

  // Only good, unambiguous and mutual matches
  std::vector<LineMatch> matches;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Best& best = best_a[i];
    if (best.index < 0 || best.first > options.max_hamming) continue;
    if (best.second <= 256 && best.first > options.max_ratio * best.second) continue;
    if (best_b[static_cast<std::size_t>(best.index)].index != static_cast<int>(i)) continue;
    matches.push_back({static_cast<int>(i), best.index, best.first});
  }

  return matches;
}

}  // namespace plumbline::features
