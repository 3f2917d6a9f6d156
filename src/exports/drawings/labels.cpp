// SPDX-License-Identifier: BSD-3-Clause
#include "drawings/labels.hpp"

#include <algorithm>
#include <cmath>

namespace plumbline::exports {
namespace {

/// True if a line across the sides of one of two convex outlines separates them.
bool is_apart(const std::vector<Eigen::Vector2d>& a, const std::vector<Eigen::Vector2d>& b) {
  for (const auto* of : {&a, &b}) {
    for (std::size_t i = 0; i < of->size(); ++i) {
      const Eigen::Vector2d side = (*of)[(i + 1) % of->size()] - (*of)[i];
      const Eigen::Vector2d axis(-side.y(), side.x());
      const auto reach = [&](const std::vector<Eigen::Vector2d>& points) {
        std::pair<double, double> range{1e300, -1e300};
        for (const Eigen::Vector2d& p : points)
          range = {std::min(range.first, axis.dot(p)), std::max(range.second, axis.dot(p))};
        return range;
      };

      const auto [a0, a1] = reach(a);
      const auto [b0, b1] = reach(b);
      if (a1 < b0 || b1 < a0) return true;
    }
  }
  return false;
}

constexpr double kLabelRoom = 0.25;  ///< room around a text, in its heights

}  // namespace

LabelPlaces::LabelPlaces(const Drawing& drawing) {
  for (const DrawnLine& line : drawing.all_lines()) {
    if (!drawing.layers[line.layer].broken_by_texts) add(line);
  }
  for (const DrawnText& text : drawing.all_texts()) add(text);
}

void LabelPlaces::add(const DrawnLine& line) {
  for (std::size_t i = line.closed ? 0 : 1; i < line.points.size(); ++i)
    lines_.push_back({line.points[(i + line.points.size() - 1) % line.points.size()], line.points[i]});
}

void LabelPlaces::add(const DrawnText& text) { texts_.push_back(box_of(text, kLabelRoom * text.height_m)); }

/// True if the text's box is apart from all texts and lines.
bool LabelPlaces::is_free(const DrawnText& text) const {
  const auto box = box_of(text, kLabelRoom * text.height_m);
  return std::none_of(texts_.begin(), texts_.end(),
                      [&](const auto& other) { return !is_apart(box, other); }) &&
         std::none_of(lines_.begin(), lines_.end(), [&](const auto& line) {
           return !is_apart(box, {line[0], line[1]});
         });
}

bool LabelPlaces::is_free(const Eigen::Vector2d& a, const Eigen::Vector2d& b) const {
  return std::none_of(texts_.begin(), texts_.end(), [&](const auto& box) { return !is_apart(box, {a, b}); });
}

/// Puts the text at the first free place, which is taken from then on.
bool LabelPlaces::place(DrawnText& text, const std::vector<Eigen::Vector2d>& places) {
  for (const Eigen::Vector2d& at : places) {
    text.at = at;
    if (!is_free(text)) continue;
    add(text);
    return true;
  }
  return false;
}

/// Places of a grid around the middle, the nearest first.
std::vector<Eigen::Vector2d> places_around(const Eigen::Vector2d& middle, double step, double farthest) {
  const int count = static_cast<int>(farthest / step);
  std::vector<Eigen::Vector2d> places;
  for (int i = -count; i <= count; ++i) {
    for (int j = -count; j <= count; ++j) places.emplace_back(middle + step * Eigen::Vector2d(i, j));
  }
  std::stable_sort(places.begin(), places.end(), [&](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return (a - middle).squaredNorm() < (b - middle).squaredNorm() - 1e-9;
  });
  return places;
}

}  // namespace plumbline::exports
