// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Plans of a cloud: walls as an architect draws them, straight lines from corner to corner, with openings,
// rooms and furniture. The method: docs/method/plans.md.
#include <Eigen/Core>
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "plumbline/cloud/types.hpp"
#include "plumbline/core/error.hpp"
#include "plumbline/core/executor.hpp"
#include "plumbline/maps/view_rays.hpp"

namespace plumbline::plans {

/// A part of a wall, from s0 to s1 along its line, metres.
struct WallOpening {
  double s0 = 0.0;
  double s1 = 0.0;
  bool to_floor = false;  ///< cameras looked through it below where a window has its sill
};

/// One side of a wall, seen from above: places p with normal . p = offset, from s0 to s1 along its direction.
struct WallLine {
  Eigen::Vector2d normal = Eigen::Vector2d::UnitX();  ///< unit, towards the cameras that see the wall
  double offset_m = 0.0;
  double s0 = 0.0;
  double s1 = 0.0;
  double top_m = 0.0;                   ///< height over the floor up to which it was seen
  double thickness_m = 0.0;             ///< of the wall; 0: its other face was not seen
  double high = 0.0;                    ///< share of its length that was seen up to where furniture ends
  bool low = false;                     ///< it ends below the height of furniture
  std::vector<WallOpening> openings;    ///< doors and passages, in order, apart
  std::vector<WallOpening> gaps;        ///< parts that the cut passes through or over: windows, lower parts
  std::array<int, 2> corner{-1, -1};    ///< the line that its first and its last end meet; -1: none
  std::array<int, 2> corner_end{0, 0};  ///< end of that line: 0 first, 1 last, 2 somewhere along it

  [[nodiscard]] Eigen::Vector2d along() const { return {-normal.y(), normal.x()}; }
  [[nodiscard]] Eigen::Vector2d at(double s) const { return offset_m * normal + s * along(); }
  [[nodiscard]] double length() const { return s1 - s0; }
};

/// Passages are wide or high openings, which have no leaf (measure_doors).
enum class OpeningKind { kDoor, kPassage, kWindow };

/// An opening of any kind, windows included, with both sides of its wall where both were seen.
struct WallDoor {
  std::array<Eigen::Vector2d, 2> jambs;  ///< on the one side, which is on the right of the way between them
  std::array<Eigen::Vector2d, 2> far_jambs;  ///< on the other; equal where it was not seen
  double width_m = 0.0;                      ///< between the faces of the jambs
  OpeningKind kind = OpeningKind::kDoor;
  double sill_m = 0.0;                          ///< over the floor
  double head_m = 0.0;                          ///< over the floor; 0: not seen
  std::array<bool, 2> jamb_seen{false, false};  ///< else where the face of the wall ends
  int hinge = -1;            ///< the jamb that its leaf hangs at; -1: the leaf was not seen
  bool opens_front = false;  ///< the leaf opens to the side of `jambs`

  [[nodiscard]] double depth_m() const { return (far_jambs[0] - jambs[0]).norm(); }
};

/// A part of a room's outline: along a wall or an opening, a gap in a wall that is assumed to be closed, or
/// the limit of what was seen.
enum class RoomSide { kWall, kGap, kLimit };

/// A room, closed where nothing of its outline is a limit.
struct WallRoom {
  std::vector<Eigen::Vector2d> outline;  ///< counter-clockwise
  double area_m2 = 0.0;                  ///< without objects from floor to ceiling
  Eigen::Vector2d label = Eigen::Vector2d::Zero();
  std::vector<RoomSide> sides;                ///< from each corner to the next; empty: all are walls
  bool closed = true;                         ///< else its area is at least what it says
  double height_m = 0.0;                      ///< median; 0: no ceiling was seen
  std::array<double, 2> heights_m{0.0, 0.0};  ///< of 90 % of the ceiling

  [[nodiscard]] RoomSide side(std::size_t i) const { return sides.empty() ? RoomSide::kWall : sides[i]; }
  [[nodiscard]] double perimeter_m() const;
};

struct WallPlan {
  std::vector<WallLine> walls;
  std::vector<WallDoor> doors;  ///< and passages, windows
  std::vector<WallRoom> rooms;
  std::vector<std::vector<Eigen::Vector2d>> furniture;  ///< outlines of what stands between walls
  bool rays_known = false;                              ///< false: only doors below a lintel are found
};

/// Cloud, heights and views that a plan is made of.
struct PlanInput {
  const cloud::Cloud& points;  ///< with normals, z up, metres
  double floor_m = 0.0;        ///< height of the floor, in the cloud's frame
  double cut_m = 1.2;          ///< over the floor
  maps::ForEachView views;     ///< in the cloud's frame; empty: what cameras looked through is not known
};

/// Finds walls, openings, rooms and furniture; the plan is empty if no wall is seen at the cut. Errors: those
/// of the views.
core::Result<WallPlan> find_walls(const PlanInput& of, const core::Executor& executor);
/// True if a place lies within an outline.
bool is_inside(const std::vector<Eigen::Vector2d>& outline, const Eigen::Vector2d& place);
/// The plan in other axes: places become origin + linear * place; lengths and areas that it tells stay.
WallPlan moved(WallPlan plan, const Eigen::Matrix2d& linear, const Eigen::Vector2d& origin);
/// The wall's pieces between its doors and gaps.
std::vector<std::pair<double, double>> solid_pieces(const WallLine& wall);
constexpr double kAssumedThickness_m = 0.1;
/// Walls from above, without openings: outlines, holes in them, and whether their thickness is assumed
/// because the other face was not seen. `unit`: of the plan for a metre.
struct WallSolid {
  std::vector<std::vector<Eigen::Vector2d>> rings;
  bool assumed = false;
};
std::vector<WallSolid> wall_solids(const WallPlan& plan, double unit);

}  // namespace plumbline::plans
