// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A rectangle cut into cells by straight lines: the middle lines of walls.
#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "plumbline/synth/plan.hpp"

namespace plumbline::synth {

inline double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

struct Cell {
  std::vector<int> points;  ///< counter-clockwise; empty: merged into another cell
  std::vector<int> walls;   ///< walls[i] leads from points[i] to the next point
  std::string kind;         ///< "": not decided
};

class Subdivision {
 public:
  /// One cell from the origin to `size`, with outer walls.
  Subdivision(const Eigen::Vector2d& size, double thickness);

  /// Cuts a convex cell; what is on the left of the line becomes a new cell, whose index is returned. Nothing
  /// if the line misses the cell.
  std::optional<int> split(int cell, const Eigen::Vector2d& point, const Eigen::Vector2d& direction,
                           double thickness);
  /// Removes the walls between two cells; false, without a change, if they would not make one simple outline
  /// or share hardly any wall.
  bool merge(int into, int from);

  /// The faces of a cell's walls; nothing if there is no room left between them.
  [[nodiscard]] std::optional<std::vector<PlanFace>> faces(const Cell& cell) const;
  [[nodiscard]] Eigen::AlignedBox2d bounds(const Cell& cell) const;
  [[nodiscard]] double area(const Cell& cell) const;

  std::vector<Cell> cells;
  std::vector<PlanWall> walls;

 private:
  int insert_point(int a, int b, const Eigen::Vector2d& p);
  std::vector<Eigen::Vector2d> points_;
};

}  // namespace plumbline::synth
