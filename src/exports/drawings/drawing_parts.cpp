// SPDX-License-Identifier: BSD-3-Clause
// Parts that a drawing's things consist of, alike in all files.
#include <algorithm>
#include <cmath>
#include <string_view>

#include "drawings/drawing.hpp"

namespace plumbline::exports {
namespace {

/// Width of a character, in font sizes, of Helvetica and its kind.
double width_of(unsigned char c) {
  constexpr std::string_view kNarrow = " .,:;!|'ijlI/()[]ftr-";
  constexpr std::string_view kWide = "mMW%@";
  if (kNarrow.find(static_cast<char>(c)) != std::string_view::npos) return 0.32;
  if (kWide.find(static_cast<char>(c)) != std::string_view::npos) return 0.87;
  if (c >= 'A' && c <= 'Z') return 0.7;
  return c >= 0x80 && c < 0xC0 ? 0.0 : 0.56;  // what continues a character of several bytes
}

/// Parts of the segment from a to b outside of a convex outline that runs counter-clockwise, from 0 to 1.
std::vector<std::pair<double, double>> parts_outside(const Eigen::Vector2d& a, const Eigen::Vector2d& b,
                                                     const std::vector<Eigen::Vector2d>& outline) {
  double from = 0.0, to = 1.0;
  for (std::size_t i = 0; i < outline.size() && from < to; ++i) {
    const Eigen::Vector2d side = outline[(i + 1) % outline.size()] - outline[i];
    const Eigen::Vector2d inward(-side.y(), side.x());
    const double at_a = inward.dot(a - outline[i]), at_b = inward.dot(b - outline[i]);
    if (at_a <= 0.0 && at_b <= 0.0) return {{0.0, 1.0}};
    if (at_a * at_b < 0.0) (at_a < 0.0 ? from : to) = std::clamp(at_a / (at_a - at_b), from, to);
  }
  if (from >= to) return {{0.0, 1.0}};

  std::vector<std::pair<double, double>> parts;
  if (from > 0.0) parts.emplace_back(0.0, from);
  if (to < 1.0) parts.emplace_back(to, 1.0);
  return parts;
}

}  // namespace

double DrawnText::width_m() const {
  constexpr double kCapital = 0.718;  // height of capitals in font sizes
  double width = 0.0;
  for (const char c : text) width += width_of(static_cast<unsigned char>(c));
  return width * height_m / kCapital;
}

/// Corners of the text as it is drawn: read from below or from the right.
std::vector<Eigen::Vector2d> box_of(const DrawnText& text, double room_m) {
  const double angle = readable_angle(text.angle_rad);
  const Eigen::Vector2d x =
      (0.5 * text.width_m() + room_m) * Eigen::Vector2d(std::cos(angle), std::sin(angle));
  const Eigen::Vector2d y =
      (0.5 * text.height_m + room_m) * Eigen::Vector2d(-std::sin(angle), std::cos(angle));
  return {text.at - x - y, text.at + x - y, text.at + x + y, text.at - x + y};
}

std::vector<DrawnLine> lines_of(const DrawnArea& area) {
  // Along lines that rise by 45 degrees, x - y is constant; they are inside between odd and even crossings.
  const auto level = [&](const Eigen::Vector2d& p) {
    return (p.y() - p.x()) / (std::sqrt(2.0) * area.spacing_m);
  };
  double low = 1e300, high = -1e300;
  for (const Eigen::Vector2d& p : area.rings.front()) {
    low = std::min(low, level(p));
    high = std::max(high, level(p));
  }

  std::vector<DrawnLine> lines;
  for (double k = std::ceil(low); k < high; k += 1.0) {
    std::vector<Eigen::Vector2d> crossings;
    for (const auto& ring : area.rings) {
      for (std::size_t i = 0; i < ring.size(); ++i) {
        const Eigen::Vector2d &a = ring[i], &b = ring[(i + 1) % ring.size()];
        if ((level(a) > k) == (level(b) > k)) continue;
        crossings.emplace_back(a + (k - level(a)) / (level(b) - level(a)) * (b - a));
      }
    }

    std::sort(crossings.begin(), crossings.end(),
              [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.sum() < b.sum(); });
    for (std::size_t i = 0; i + 1 < crossings.size(); i += 2)
      lines.push_back({area.layer, {crossings[i], crossings[i + 1]}});
  }
  return lines;
}

std::vector<DrawnLine> lines_of(const DrawnDimension& d) {
  const double size = d.label.height_m;
  const Eigen::Vector2d along = (d.to - d.from).normalized();
  const Eigen::Vector2d out = d.beside.norm() > 0.0 ? d.beside.normalized() : Eigen::Vector2d::Zero();
  const Eigen::Vector2d a = d.from + d.beside, b = d.to + d.beside;
  std::vector<DrawnLine> lines{{d.layer, {a, b}}};

  // Lines from the places, and a stroke across each end.
  for (const auto& [place, end] : {std::pair(d.from, a), std::pair(d.to, b)}) {
    if (d.beside.norm() > 0.6 * size)
      lines.push_back({d.layer, {place + 0.5 * size * out, end + 0.5 * size * out}});
    const Eigen::Vector2d stroke = 0.35 * size * (along + Eigen::Vector2d(-along.y(), along.x()));
    lines.push_back({d.layer, {end - stroke, end + stroke}});
  }

  if (d.leader) {
    const Eigen::Vector2d middle = 0.5 * (a + b);
    const auto box = box_of(d.label, 0.25 * size);
    const Eigen::Vector2d left = 0.5 * (box[0] + box[3]), right = 0.5 * (box[1] + box[2]);
    lines.push_back({d.layer, {middle, (left - middle).norm() < (right - middle).norm() ? left : right}});
  }
  return lines;
}

std::vector<DrawnLine> lines_of(const DrawnSymbol& symbol, const DrawnBlock& block) {
  // A block is given in a square of one metre
  std::vector<DrawnLine> lines = block.lines;
  for (DrawnLine& line : lines) {
    line.layer = symbol.layer;
    for (Eigen::Vector2d& p : line.points) p = (symbol.at + p.x() * symbol.x + p.y() * symbol.y).eval();
  }
  return lines;
}

std::vector<DrawnLine> Drawing::all_lines() const {
  // All files draw the same lines
  std::vector<DrawnLine> all = lines;
  const auto add = [&](const std::vector<DrawnLine>& more) {
    all.insert(all.end(), more.begin(), more.end());
  };
  for (const DrawnArea& area : areas) add(exports::lines_of(area));
  for (const DrawnSymbol& symbol : symbols) add(exports::lines_of(symbol, blocks[symbol.block]));
  for (const DrawnDimension& dimension : dimensions) add(exports::lines_of(dimension));
  return all;
}

std::vector<DrawnText> Drawing::all_texts() const {
  std::vector<DrawnText> all = texts;
  for (const DrawnDimension& dimension : dimensions) all.push_back(dimension.label);
  return all;
}

std::pair<Eigen::Vector2d, Eigen::Vector2d> Drawing::bounds() const {
  Eigen::Vector2d low = Eigen::Vector2d::Constant(1e300);
  Eigen::Vector2d high = -low;
  const auto add = [&](const std::vector<Eigen::Vector2d>& points) {
    for (const Eigen::Vector2d& p : points) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
  };

  // Lines and texts that the sheet must hold
  for (const DrawnLine& line : all_lines()) add(line.points);
  for (const DrawnText& text : all_texts()) add(box_of(text));
  if (low.x() > high.x()) return {Eigen::Vector2d::Zero(), Eigen::Vector2d::Ones()};
  return {low, high};
}

void Drawing::break_lines() {
  constexpr double kRoom = 0.3;  // of a text's height
  for (const DrawnText& text : all_texts()) {
    const std::vector<Eigen::Vector2d> box = box_of(text, kRoom * text.height_m);
    std::vector<DrawnLine> kept;
    for (DrawnLine& line : lines) {
      const std::size_t count = line.points.size() - (line.closed ? 0 : 1);
      std::vector<DrawnLine> pieces;
      bool whole = !layers[line.layer].broken_by_texts || line.filled;

      // Parts that touch go on one line.
      for (std::size_t i = 0; !whole && i < count; ++i) {
        const Eigen::Vector2d &a = line.points[i], &b = line.points[(i + 1) % line.points.size()];
        for (const auto& [from, to] : parts_outside(a, b, box)) {
          const Eigen::Vector2d first = a + from * (b - a), last = a + to * (b - a);
          if (from == 0.0 && !pieces.empty() && pieces.back().points.back() == a) {
            pieces.back().points.push_back(last);
          } else {
            pieces.push_back({line.layer, {first, last}, false, false, line.dashed});
          }
        }
      }

      whole = whole || (pieces.size() == 1 && pieces[0].points.size() == count + 1 &&
                        pieces[0].points.front() == line.points.front() &&
                        pieces[0].points.back() == (line.closed ? line.points.front() : line.points.back()));
      if (whole) pieces = {std::move(line)};
      for (DrawnLine& piece : pieces) kept.push_back(std::move(piece));
    }
    lines = std::move(kept);
  }
}

}  // namespace plumbline::exports
