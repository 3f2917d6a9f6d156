// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The plane cut along the lines of walls into convex cells, of which rooms are made.
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <vector>

#include "free_space.hpp"
#include "plumbline/plans/plan.hpp"

namespace plumbline::plans {

using PlanOutline = std::vector<Eigen::Vector2d>;  ///< counter-clockwise
using PlanSegment = std::array<Eigen::Vector2d, 2>;

struct RoomCell {
  PlanOutline outline;  ///< convex
  double area_m2 = 0.0;
  double free = 0.0;     ///< share that cameras looked through
  bool opening = false;  ///< it lies between the jambs of a door or a passage
};

/// The part of a border that two cells share; `a` is on its left.
struct CellBorder {
  std::size_t a = 0, b = 0;
  PlanSegment ends;
};

double area_of(const PlanOutline& outline);
/// The four corners of each opening, counter-clockwise.
std::vector<PlanOutline> openings_of(const std::vector<WallDoor>& doors);
/// Cells of the box, cut at walls, also a little beyond their ends, at openings, and where the limit of what
/// was seen passes through them.
std::vector<RoomCell> cells_of(const Eigen::AlignedBox2d& box, const std::vector<WallLine>& walls,
                               const std::vector<PlanOutline>& openings, const FreeSpace& space);
std::vector<CellBorder> borders_of(const std::vector<RoomCell>& cells);
/// Parts of a segment, as shares of it from 0 to 1 in order, along which a wall or the side of an opening
/// runs. `off_m`: distance of walls that still count.
std::vector<WallOpening> walled_parts(const PlanSegment& segment, const std::vector<WallLine>& walls,
                                      const std::vector<PlanOutline>& openings, double off_m = 0.03);
/// Rooms: cells that a minimum cut finds to be inside, joined where neither a wall nor one of the `closings`
/// is between them. Largest first.
std::vector<WallRoom> rooms_in(const Eigen::AlignedBox2d& box, const std::vector<WallLine>& walls,
                               const std::vector<WallLine>& closings, const std::vector<WallDoor>& doors,
                               const FreeSpace& space);

}  // namespace plumbline::plans
