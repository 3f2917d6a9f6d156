// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "lines/line_geometry.hpp"
#include "plumbline/core/clones.hpp"
#include "plumbline/features/line_detector.hpp"

namespace plumbline::features {
namespace {

constexpr float kDuplicateOffset = 1.0F;  // px: overlapping parallels nearer than this are one edge
constexpr float kSameDirection = 0.8F;    // cosine; opposite steps are the two edges of a thin line

// A segment with the quantities that the pairwise tests need.
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
  if (a.direction.dot(b.direction) <= kSameDirection) return false;
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

/// Quantities for the quick test of pairs, in columns.
struct Glance {
  std::vector<float> dx, dy, mx, my, length;

  explicit Glance(const std::vector<Piece>& pieces) {
    for (std::vector<float>* column : {&dx, &dy, &mx, &my, &length}) column->resize(pieces.size());
    for (std::size_t i = 0; i < pieces.size(); ++i) set(i, pieces[i]);
  }
  void set(std::size_t i, const Piece& piece) {
    dx[i] = piece.direction.x();
    dy[i] = piece.direction.y();
    mx[i] = piece.middle.x();
    my[i] = piece.middle.y();
    length[i] = piece.length;
  }
  /// Takes a piece out: without a direction it matches nothing.
  void take_out(std::size_t i) { dx[i] = dy[i] = 0.0F; }
};

/// True if any of the pieces [first, last) passes the first test of belong_together() with the piece `own`:
/// about the same direction, and not far to the side.
PLUMBLINE_CLONES bool any_near(const Glance& all, std::size_t first, std::size_t last, std::size_t own,
                               float offset_limit) {
  const float *dx = all.dx.data(), *dy = all.dy.data(), *mx = all.mx.data(), *my = all.my.data();
  const float* length = all.length.data();
  const float own_dx = dx[own], own_dy = dy[own], own_mx = mx[own], own_my = my[own];
  const float own_length = length[own];
  int found = 0;
  for (std::size_t j = first; j < last; ++j) {
    const float along = own_dx * dx[j] + own_dy * dy[j];
    const float x = mx[j] - own_mx, y = my[j] - own_my;
    // The direction is that of the longer piece.
    const bool longer = own_length >= length[j];
    const float direction_x = longer ? own_dx : dx[j], direction_y = longer ? own_dy : dy[j];
    const float offset = std::abs(direction_x * y - direction_y * x);
    found |= static_cast<int>((along > kSameDirection) & (offset <= offset_limit));
  }
  return found != 0;
}

// Least-squares line through both (weight = length), spanning both.
LineSegment merged(const LineSegment& a, const LineSegment& b) {
  const float la = a.length();
  const float lb = b.length();
  const Eigen::Vector2f centre = (la * a.middle() + lb * b.middle()) / (la + lb);

  // Scatter of points spread evenly over both
  Eigen::Matrix2f scatter = Eigen::Matrix2f::Zero();
  for (const LineSegment* s : {&a, &b}) {
    const Eigen::Vector2f m = s->middle() - centre;
    const Eigen::Vector2f h = s->end - s->start;
    scatter += s->length() * (m * m.transpose() + h * h.transpose() / 12.0F);
  }

  // Principal direction, as the first segment points
  const float angle = 0.5F * std::atan2(2.0F * scatter(0, 1), scatter(0, 0) - scatter(1, 1));
  Eigen::Vector2f d(std::cos(angle), std::sin(angle));
  if (d.dot(a.end - a.start) < 0.0F) d = -d;

  // Extent of all four ends along it
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
  constexpr std::size_t kAtATime = 32;
  Glance glance(pieces);
  std::vector<char> gone(pieces.size(), 0);

  // The first partner; blocks without one are skipped
  const auto partner_of = [&](std::size_t i) {
    for (std::size_t first = 0; first < pieces.size(); first += kAtATime) {
      const std::size_t last = std::min(pieces.size(), first + kAtATime);
      if (!any_near(glance, first, last, i, static_cast<float>(options.join_offset_px))) continue;
      for (std::size_t j = first; j < last; ++j) {
        if (j != i && gone[j] == 0 && belong_together(pieces[i], pieces[j], options)) return j;
      }
    }
    return pieces.size();
  };

  for (std::size_t i = 0; i < pieces.size(); ++i) {
    if (gone[i] != 0) continue;
    // Pieces that did not fit the shorter line may fit the joined one: search from the start again.
    for (std::size_t j = partner_of(i); j < pieces.size(); j = partner_of(i)) {
      pieces[i] = Piece(merged(pieces[i].segment, pieces[j].segment));
      glance.set(i, pieces[i]);
      glance.take_out(j);
      gone[j] = 1;
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
