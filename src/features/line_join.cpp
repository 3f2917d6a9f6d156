// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "line_geometry.hpp"
#include "plumbline/features/line_detector.hpp"

namespace plumbline::features {
namespace {

constexpr float kDuplicateOffset = 1.0F;  // px: overlapping parallels nearer than this are one edge

// A segment with what the pairwise tests need again and again.
struct Piece {
  LineSegment segment;
  Eigen::Vector2f direction;
  Eigen::Vector2f normal;
  Eigen::Vector2f middle;
  float length;
  explicit Piece(const LineSegment& s)
      : segment(s),
        direction(s.direction()),
        normal(right_of(direction)),
        middle(s.middle()),
        length(s.length()) {}
};

bool belong_together(const Piece& a, const Piece& b, const LineDetectorOptions& options) {
  if (a.direction.dot(b.direction) <= 0.8F) return false;  // opposite steps: the two edges of a thin line
  const Piece& longer = a.length >= b.length ? a : b;
  const Piece& shorter = a.length >= b.length ? b : a;
  const Eigen::Vector2f between = shorter.middle - longer.middle;
  const auto offset_limit = static_cast<float>(options.join_offset_px);
  const float offset_at_middle = std::abs(longer.normal.dot(between));
  if (offset_at_middle > offset_limit) return false;
  const float gap = std::abs(longer.direction.dot(between)) - 0.5F * (longer.length + shorter.length);
  if (gap > static_cast<float>(options.join_gap_px)) return false;
  // A short piece's angle is uncertain by about a pixel over its length.
  const float angle = std::abs(longer.normal.dot(shorter.direction));
  if (angle > std::max(static_cast<float>(options.join_angle_rad), 1.5F / shorter.length)) return false;
  const float offset = offset_at_middle + 0.5F * shorter.length * angle;  // of the farther end
  const bool overlapping = gap < -0.25F * shorter.length;
  return offset <= (overlapping ? std::min(kDuplicateOffset, offset_limit) : offset_limit);
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
  std::vector<Piece> pieces;
  pieces.reserve(segments.size());
  for (const LineSegment& s : segments) pieces.emplace_back(s);
  // Longest lines grow first, each by its first fitting partner, until nothing fits any more.
  std::vector<char> gone(pieces.size(), 0);
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    for (std::size_t j = 0; gone[i] == 0 && j < pieces.size(); ++j) {
      if (j == i || gone[j] != 0 || !belong_together(pieces[i], pieces[j], options)) continue;
      pieces[i] = Piece(merged(pieces[i].segment, pieces[j].segment));
      gone[j] = 1;
      j = static_cast<std::size_t>(-1);  // what did not fit the shorter line may fit now: from the start
    }
  }
  segments.clear();
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    if (gone[i] == 0) segments.push_back(pieces[i].segment);
  }
  sort_segments(segments);
  return segments;
}

}  // namespace plumbline::features
