// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <optional>

#include "line_geometry.hpp"
#include "plumbline/features/line_detector.hpp"

namespace plumbline::features {
namespace {

constexpr float kDuplicateOffset = 1.0F;  // px: overlapping parallels nearer than this are one edge

// How `other` lies along and beside `base`, in base's frame.
struct Placement {
  float low, high;  // projections of other's ends on base, px from base.start
  float offset;     // largest distance of other's ends from base's line
  float gap;        // px between them along base; negative = overlap
};

Placement place(const LineSegment& base, const LineSegment& other) {
  const Eigen::Vector2f d = base.direction();
  const Eigen::Vector2f n = right_of(d);
  const Eigen::Vector2f s = other.start - base.start;
  const Eigen::Vector2f e = other.end - base.start;
  const float a = d.dot(s);
  const float b = d.dot(e);
  Placement p{};
  p.low = std::min(a, b);
  p.high = std::max(a, b);
  p.offset = std::max(std::abs(n.dot(s)), std::abs(n.dot(e)));
  p.gap = std::max(p.low - base.length(), -p.high);
  return p;
}

bool belong_together(const LineSegment& longer, const LineSegment& shorter,
                     const LineDetectorOptions& options) {
  const Eigen::Vector2f d = longer.direction();
  const Eigen::Vector2f e = shorter.direction();
  if (d.dot(e) <= 0.0F) return false;  // opposite steps: the two edges of a thin line
  const Placement p = place(longer, shorter);
  if (p.gap > static_cast<float>(options.join_gap_px)) return false;
  if (p.offset > static_cast<float>(options.join_offset_px)) return false;
  // A short piece's angle is uncertain by about a pixel over its length.
  const float angle = std::abs(d.x() * e.y() - d.y() * e.x());
  if (angle > std::max(static_cast<float>(options.join_angle_rad), 1.5F / shorter.length())) return false;
  const bool overlapping = p.gap < -0.25F * shorter.length();
  return !overlapping || p.offset <= kDuplicateOffset;
}

// Least-squares line through both (weight = length), spanning both.
LineSegment merged(const LineSegment& a, const LineSegment& b) {
  const float la = a.length();
  const float lb = b.length();
  const Eigen::Vector2f centre = (la * a.middle() + lb * b.middle()) / (la + lb);
  Eigen::Matrix2f scatter = Eigen::Matrix2f::Zero();
  for (const LineSegment* s : {&a, &b}) {
    const Eigen::Vector2f m = s->middle() - centre;
    const Eigen::Vector2f h = s->end - s->start;
    scatter += s->length() * (m * m.transpose() + h * h.transpose() / 12.0F);
  }
  const float angle = 0.5F * std::atan2(2.0F * scatter(0, 1), scatter(0, 0) - scatter(1, 1));
  Eigen::Vector2f d(std::cos(angle), std::sin(angle));
  if (d.dot(a.end - a.start) < 0.0F) d = -d;
  float low = 0.0F;
  float high = 0.0F;
  for (const Eigen::Vector2f& p : {a.start, a.end, b.start, b.end}) {
    low = std::min(low, d.dot(p - centre));
    high = std::max(high, d.dot(p - centre));
  }
  LineSegment result;
  result.start = centre + low * d;
  result.end = centre + high * d;
  result.response = (la * a.response + lb * b.response) / (la + lb);
  return result;
}

}  // namespace

std::vector<LineSegment> join_collinear(std::vector<LineSegment> segments,
                                        const LineDetectorOptions& options) {
  segments.erase(std::remove_if(segments.begin(), segments.end(),
                                [](const LineSegment& s) { return !(s.length() > 0.0F); }),
                 segments.end());
  sort_segments(segments);
  // Each line grows by its first fitting partner until none fits; longest lines grow first.
  for (std::size_t i = 0; i < segments.size(); ++i) {
    bool grown = true;
    while (grown) {
      grown = false;
      for (std::size_t j = 0; j < segments.size(); ++j) {
        if (j == i || !belong_together(segments[i], segments[j], options)) continue;
        segments[i] = merged(segments[i], segments[j]);
        segments.erase(segments.begin() + static_cast<std::ptrdiff_t>(j));
        if (j < i) --i;
        grown = true;
        break;
      }
    }
  }
  sort_segments(segments);
  return segments;
}

}  // namespace plumbline::features
