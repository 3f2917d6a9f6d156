// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Walls as an architect draws them: straight lines from corner to corner, with the doors in them.
#include <Eigen/Core>
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "source/map_source.hpp"

namespace plumbline::exports {

/// A part of a wall, from s0 to s1 along its line, metres.
struct WallOpening {
  double s0 = 0.0;
  double s1 = 0.0;
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

/// Finds walls, doors and rooms of the selected part of a map at --cut over its floor. Errors (kInput): no
/// normals, no walls.
core::Result<WallPlan> find_walls(MapSource& source);

// Steps of it.

/// Sides of walls that the cloud shows, without openings and corners; tall furniture is among them.
std::vector<WallLine> wall_sides(const cloud::Cloud& cloud, double floor_m, double cut_m,
                                 const core::Executor& executor);
/// Fits each line again to all points of the cloud between its ends.
void fit_sides(const cloud::Cloud& cloud, double floor_m, const core::Executor& executor,
               std::vector<WallLine>& walls);
/// Lets ends meet where lines cross.
void join_corners(std::vector<WallLine>& walls);
/// Rooms where it is not known what cameras looked through: chains of walls that meet all round.
std::vector<WallRoom> rooms_of(const std::vector<WallLine>& walls);
/// Jambs, heads, sills and kinds of doors.
void measure_doors(const cloud::Cloud& cloud, double floor_m, std::vector<WallDoor>& doors);
/// Heights of rooms whose ceilings were seen.
void measure_heights(const cloud::Cloud& cloud, double floor_m, std::vector<WallRoom>& rooms);
/// Outlines of what is seen from the height of a foot to that of a head and is no wall.
std::vector<std::vector<Eigen::Vector2d>> furniture_outlines(const cloud::Cloud& cloud, double floor_m,
                                                             const std::vector<WallLine>& walls);
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
/// Sentences on what the plan holds.
std::vector<std::string> notes_of(const WallPlan& plan);
/// The plan as JSON, described on the format's page.
std::string plan_json(const WallPlan& plan, const std::string& frame, double floor_m, double cut_m);

}  // namespace plumbline::exports
