// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/features/line_match.hpp"

#include <algorithm>
#include <cmath>

namespace plumbline::features {
namespace {

struct Shape {
  Eigen::Vector2f direction;
  Eigen::Vector2f middle;
  float length;
};

std::vector<Shape> shapes(const std::vector<DescribedLine>& lines) {
  std::vector<Shape> result;
  result.reserve(lines.size());
  for (const DescribedLine& l : lines) {
    result.push_back({l.segment.direction(), l.segment.middle(), l.segment.length()});
  }
  return result;
}

double overlap(const Shape& a, const Shape& b) {
  const Shape& longer = a.length >= b.length ? a : b;
  const Shape& shorter = a.length >= b.length ? b : a;
  if (!(shorter.length > 0.0F)) return 0.0;
  // Projection of the shorter on the longer's axis, as an interval about its middle.
  const float reach = 0.5F * shorter.length * std::abs(longer.direction.dot(shorter.direction));
  const float at = longer.direction.dot(shorter.middle - longer.middle);
  const float half = 0.5F * longer.length;
  const float common = std::min(half, at + reach) - std::max(-half, at - reach);
  return std::clamp(static_cast<double>(common / shorter.length), 0.0, 1.0);
}

// What the shapes must satisfy before descriptors are compared.
class Gate {
 public:
  explicit Gate(const LineMatchOptions& options)
      : options_(options), min_cosine_(static_cast<float>(std::cos(options.max_angle_rad))) {}

  [[nodiscard]] bool passes(const Shape& a, const Shape& b) const {
    if (a.direction.dot(b.direction) < min_cosine_) return false;
    const auto ratio = static_cast<float>(options_.min_length_ratio);
    if (std::min(a.length, b.length) < ratio * std::max(a.length, b.length)) return false;
    if (options_.max_distance_px > 0.0 && !near(a, b)) return false;
    return options_.min_overlap <= 0.0 || overlap(a, b) >= options_.min_overlap;
  }

 private:
  [[nodiscard]] bool near(const Shape& a, const Shape& b) const {
    const Eigen::Vector2f between = b.middle - a.middle;
    const float across = std::abs(a.direction.x() * between.y() - a.direction.y() * between.x());
    const float along = std::abs(a.direction.dot(between));
    const auto limit = static_cast<float>(options_.max_distance_px);
    // Ends move along a line from frame to frame: lines may slide by as much as half of both together.
    return across <= limit && along <= limit + 0.5F * (a.length + b.length);
  }

  const LineMatchOptions& options_;
  float min_cosine_;
};

struct Best {
  int index = -1;
  int first = 257;
  int second = 257;
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

void LineMatchOptions::declare(core::OptionTable& table) {
  table.integer("max_hamming", max_hamming, {0, 256}, "", "Largest number of differing descriptor bits");
  table.number("max_ratio", max_ratio, {0.1, 1.0}, "",
               "Best over second best distance; 1 switches the test off");
  table.boolean("mutual", mutual, "Keep pairs that are each other's best only");
  table.number("max_angle", max_angle_rad, {0.0, 3.15}, "rad", "Largest angle between directed lines");
  table.number("min_length_ratio", min_length_ratio, {0.0, 1.0}, "",
               "Smallest ratio of shorter to longer line");
  table.number("max_distance", max_distance_px, {0.0, 10000.0}, "px",
               "Largest distance between lines; 0 is off");
  table.number("min_overlap", min_overlap, {0.0, 1.0}, "",
               "Smallest share of the shorter line on the other; 0 is off");
}

double overlap(const LineSegment& a, const LineSegment& b) {
  return overlap(Shape{a.direction(), a.middle(), a.length()}, Shape{b.direction(), b.middle(), b.length()});
}

std::vector<LineMatch> match_lines(const std::vector<DescribedLine>& a, const std::vector<DescribedLine>& b,
                                   const LineMatchOptions& options) {
  const Gate gate(options);
  const std::vector<Shape> shapes_a = shapes(a);
  const std::vector<Shape> shapes_b = shapes(b);
  std::vector<Best> best_a(a.size());
  std::vector<Best> best_b(b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t j = 0; j < b.size(); ++j) {
      if (!gate.passes(shapes_a[i], shapes_b[j])) continue;
      const int distance = hamming(a[i].descriptor, b[j].descriptor);
      best_a[i].offer(static_cast<int>(j), distance);
      best_b[j].offer(static_cast<int>(i), distance);
    }
  }
  std::vector<LineMatch> matches;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Best& best = best_a[i];
    if (best.index < 0 || best.first > options.max_hamming) continue;
    if (best.second <= 256 && best.first > options.max_ratio * best.second) continue;
    if (options.mutual && best_b[static_cast<std::size_t>(best.index)].index != static_cast<int>(i)) continue;
    matches.push_back({static_cast<int>(i), best.index, best.first});
  }
  return matches;
}

}  // namespace plumbline::features
