// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Free places for texts of a drawing.
#include <Eigen/Core>
#include <array>
#include <vector>

#include "drawings/drawing.hpp"

namespace plumbline::exports {

/// Texts and lines that a further text must not touch.
class LabelPlaces {
 public:
  /// Avoids all of the drawing but the layers that texts break.
  explicit LabelPlaces(const Drawing& drawing);

  void add(const DrawnLine& line);
  void add(const DrawnText& text);
  [[nodiscard]] bool is_free(const DrawnText& text) const;
  /// True if no text lies on the segment.
  [[nodiscard]] bool is_free(const Eigen::Vector2d& a, const Eigen::Vector2d& b) const;
  /// Moves the text to the first of the places that is free, and adds it. False: none is.
  bool place(DrawnText& text, const std::vector<Eigen::Vector2d>& places);

 private:
  std::vector<std::vector<Eigen::Vector2d>> texts_;  ///< their corners
  std::vector<std::array<Eigen::Vector2d, 2>> lines_;
};

/// Places around one, nearest first, `step` apart up to `farthest`.
std::vector<Eigen::Vector2d> places_around(const Eigen::Vector2d& middle, double step, double farthest);

}  // namespace plumbline::exports
