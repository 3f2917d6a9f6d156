// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Steps from the sides of walls that a cloud shows to a plan with corners and doors.
#include <memory>
#include <vector>

#include "plumbline/plans/plan.hpp"
#include "wall_raster.hpp"

namespace plumbline::plans {

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

/// The height of the cut over the floor, metres, and the heights between which a column must be free to be
/// part of a door.
struct Cut {
  double at_m;
  double low_m;
  double high_m;
  bool rays_known;
};

/// Drops tall sides that are not walls: cameras looked over them, or they stand in front of a wall. Without
/// rays only what reaches high is known to be a wall.
void drop_furniture(std::vector<WallLine>& walls, std::vector<WallRaster>& rasters, bool rays_known);
/// Drops low sides that are not one of the two faces of a thin wall, such as the fronts of furniture.
void drop_low_furniture(std::vector<WallLine>& walls);
/// Drops door leaves and parts of furniture: short sides that neither meet walls at both ends, or one at a
/// right angle, nor continue along a line.
void drop_loose_sides(std::vector<WallLine>& walls, std::vector<WallRaster>& rasters);

/// Drops leaves of doors that stand open.
void drop_leaves(std::vector<WallLine>& walls, std::vector<WallRaster>& rasters, const Cut& cut);
/// Moves ends that meet no wall to the line of a wall that passes within a few centimetres of them, where
/// that wall was hidden.
void meet_hidden_walls(std::vector<WallLine>& walls);

/// Rasters of a side's first and last part; the same one for a side that was not joined from parts.
struct Fronts {
  std::shared_ptr<const WallRaster> first, last;
};

constexpr double kNarrowestDoor_m = 0.55;
constexpr double kWidestDoor_m = 2.0;     ///< of two leaves
constexpr double kWidestPassage_m = 3.0;  ///< of which both jambs were seen, else it is a gap
constexpr double kThickestWall_m = 0.45;

/// Drops sides that the cut passes over or below, and finds the gaps of the others.
void cut_sides(std::vector<WallLine>& walls, std::vector<WallRaster>& rasters, const Cut& cut);
/// Parts between two places of a side where the cut meets no wall: cameras looked through, or it is a hole
/// over a level sill, between wall, that nothing at the wall hides: a window whose pane reflects nothing.
std::vector<WallOpening> gaps_between(const WallRaster& raster, double s0, double s1, const Cut& cut);
/// Drops gaps that are doors.
void drop_gaps_at_doors(WallLine& wall);
/// Makes gaps of openings that proved to be no doors when they were measured: windows, and wide ones of which
/// a jamb was not seen.
void take_back_doors(std::vector<WallDoor>& doors, std::vector<WallLine>& walls);

/// Openings between two places of a side.
std::vector<WallOpening> openings_between(const WallRaster& raster, double s0, double s1, const Cut& cut);
/// Joins sides that lie on one line where the wall between them was only hidden, or is a door.
void bridge_gaps(std::vector<WallLine>& walls, std::vector<Fronts>& fronts, const Cut& cut);
/// Doors of openings. Openings that are one door, on the two sides of a wall, become equally wide where a
/// door leaf hid a part of one.
std::vector<WallDoor> doors_of(std::vector<WallLine>& walls);
/// Doors whose jambs were seen from different sides of the wall, one from each.
std::vector<WallDoor> doors_between_sides(const std::vector<WallLine>& walls,
                                          const std::vector<Fronts>& fronts, const Cut& cut);

/// Gives doors of which one side was seen the face of a wall behind them as their other side.
void find_far_sides(const std::vector<WallLine>& walls, std::vector<WallDoor>& doors);
/// Openings between the free end of a wall and the wall that its line meets next, which are the rest of it.
std::vector<WallDoor> doors_at_free_ends(const std::vector<WallLine>& walls,
                                         const std::vector<WallDoor>& doors);
/// Openings wider than doors between two faces that lie on one line. They are no more than unseen wall unless
/// both their jambs were seen.
std::vector<WallDoor> passages_in_line(const std::vector<WallLine>& walls, const std::vector<Fronts>& fronts,
                                       const Cut& cut, const std::vector<WallDoor>& doors);
/// Hinges of doors whose leaves were seen.
void find_leaves(const cloud::Cloud& cloud, double floor_m, const std::vector<WallLine>& walls,
                 std::vector<WallDoor>& doors);
/// Gaps at the cut whose edges were seen. The gaps of the walls become as wide as they are.
std::vector<WallDoor> windows_of(const cloud::Cloud& cloud, double floor_m, double cut_m,
                                 std::vector<WallLine>& walls);
/// Ends the faces of walls at the jambs.
void cut_walls_at(const std::vector<WallDoor>& openings, std::vector<WallLine>& walls);
/// The line from the one jamb to the other, as a wall.
WallLine closing_of(const WallDoor& door);

}  // namespace plumbline::plans
