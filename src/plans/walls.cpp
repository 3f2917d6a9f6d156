// SPDX-License-Identifier: BSD-3-Clause
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "plumbline/plans/plan.hpp"
#include "room_cells.hpp"
#include "wall_steps.hpp"

namespace plumbline::plans {
namespace {

/// Surface and rays of walls, each from a little before its start to a little behind its end.
std::vector<WallRaster> rasters_of(const std::vector<WallLine>& walls, const cloud::Cloud& cloud,
                                   double floor_m) {
  constexpr double kSlab_m = 0.03;
  std::vector<WallRaster> rasters;
  rasters.reserve(walls.size());
  for (const WallLine& wall : walls)
    rasters.emplace_back(wall.normal, wall.offset_m, wall.s0 - kWidestPassage_m, wall.s1 + kWidestPassage_m,
                         floor_m);
  for (const cloud::Point& p : cloud) {
    if (!(std::abs(p.normal_z) < 0.4F)) continue;
    const Eigen::Vector3d at = p.getVector3fMap().cast<double>();
    for (std::size_t i = 0; i < walls.size(); ++i) {
      const double h = walls[i].normal.dot(at.head<2>()) - walls[i].offset_m;
      const double facing = walls[i].normal.x() * p.normal_x + walls[i].normal.y() * p.normal_y;
      if (std::abs(h) < kSlab_m && facing > 0.8) rasters[i].add_surface(at);
    }
  }
  return rasters;
}

/// The plan's part of the map, with room for what lies beside the walls.
Eigen::AlignedBox2d box_of(const std::vector<WallLine>& walls) {
  Eigen::AlignedBox2d box;
  for (const WallLine& wall : walls) {
    box.extend(wall.at(wall.s0));
    box.extend(wall.at(wall.s1));
  }
  const Eigen::Vector2d margin = Eigen::Vector2d::Constant(4.0);  // cameras may be beyond
  return {box.min() - margin, box.max() + margin};
}

/// Adds a candidate for an opening if both its jambs are seen in the cloud, and it is no window and none of
/// those that are known; true: it was added.
bool add_if_seen(const cloud::Cloud& cloud, double floor_m, const WallDoor& candidate, WallPlan& plan) {
  constexpr double kSame_m = 0.3;
  std::vector<WallDoor> measured{candidate};
  measure_doors(cloud, floor_m, measured);
  const WallDoor& m = measured.front();
  const bool again = std::any_of(plan.doors.begin(), plan.doors.end(), [&](const WallDoor& other) {
    return (other.jambs[0] + other.jambs[1] - m.jambs[0] - m.jambs[1]).norm() <
           2.0 * (kSame_m + other.depth_m());
  });
  const bool seen = !again && m.kind != OpeningKind::kWindow && m.jamb_seen[0] && m.jamb_seen[1] &&
                    m.width_m > kNarrowestDoor_m;
  if (seen) plan.doors.push_back(m);
  return seen;
}

/// Adds passages between two faces on one line whose jambs were both seen.
void add_passages(const PlanInput& of, const std::vector<Fronts>& fronts, const Cut& cut, WallPlan& plan) {
  std::vector<WallDoor> wide = passages_in_line(plan.walls, fronts, cut, plan.doors);
  find_far_sides(plan.walls, wide);
  for (const WallDoor& door : wide) add_if_seen(of.points, of.floor_m, door, plan);
}

/// Adds openings at free ends of walls whose jambs were both seen, and gives the lines that close the others.
std::vector<WallLine> close_free_ends(const cloud::Cloud& cloud, double floor_m, WallPlan& plan) {
  std::vector<WallDoor> at_ends = doors_at_free_ends(plan.walls, plan.doors);
  find_far_sides(plan.walls, at_ends);
  std::vector<WallLine> closings;
  for (const WallDoor& door : at_ends) {
    if (!add_if_seen(cloud, floor_m, door, plan)) closings.push_back(closing_of(door));
  }
  return closings;
}

/// The line of an opening, as far as the walls that it meets beside its jambs: what is left of its own wall
/// there may be too short to be seen.
WallLine to_next_walls(WallLine line, const std::vector<WallLine>& walls) {
  constexpr double kFarthest_m = 0.4, kLeastTurn = 0.5, kBeside_m = 0.15;
  for (const double sign : {-1.0, 1.0}) {
    double& end = sign < 0.0 ? line.s0 : line.s1;
    const Eigen::Vector2d from = line.at(end), way = sign * line.along();
    double nearest = kFarthest_m;
    for (const WallLine& wall : walls) {
      const double turn = wall.normal.dot(way);
      if (turn > -kLeastTurn) continue;
      const double distance = (wall.offset_m - wall.normal.dot(from)) / turn;
      const double s = wall.along().dot(from + distance * way);
      if (distance > 0.0 && distance < nearest && s > wall.s0 - kBeside_m && s < wall.s1 + kBeside_m)
        nearest = distance;
    }
    if (nearest < kFarthest_m) end += sign * nearest;
  }
  return line;
}

/// Thickness of walls of which both faces were seen.
void set_thickness(std::vector<WallLine>& walls) {
  constexpr double kLeastCommon_m = 0.3;
  for (WallLine& wall : walls) {
    double nearest = kThickestWall_m;
    for (const WallLine& other : walls) {
      const double behind = wall.offset_m - wall.normal.dot(other.at(0.5 * (other.s0 + other.s1)));
      const double first = wall.along().dot(other.at(other.s1)), last = wall.along().dot(other.at(other.s0));
      const double common = std::min(wall.s1, last) - std::max(wall.s0, first);
      if (wall.normal.dot(other.normal) > -0.99 || behind < 0.02 || behind > nearest ||
          common < kLeastCommon_m)
        continue;
      nearest = behind;
      wall.thickness_m = behind;
    }
  }
}

/// Rays of all views into the space and onto the walls; the views may be unknown.
core::Result<void> see_through_views(const PlanInput& of, const core::Executor& executor, FreeSpace& space,
                                     std::vector<WallRaster>& rasters) {
  return of.views([&](const maps::ViewRays& rays) -> core::Result<void> {
    space.add(rays);
    executor.parallel_for(rasters.size(), [&](std::size_t i) { rasters[i].add_rays(rays); });
    return {};
  });
}

/// A cut and the heights beside it that tell an opening from what hides a wall.
Cut cut_at(double cut_m, bool rays_known) {
  constexpr double kLintel_m = 2.0;
  return {cut_m, std::max(0.25, cut_m - 0.3), std::clamp(cut_m + 0.3, 0.0, std::max(kLintel_m, cut_m + 0.1)),
          rays_known};
}

/// Finds openings in walls and joins pieces of one wall over them; the rasters of each joined side.
std::vector<Fronts> join_sides(const PlanInput& of, const core::Executor& executor, const Cut& cut,
                               std::vector<WallRaster>& rasters, std::vector<WallLine>& walls) {
  join_corners(walls);
  for (std::size_t i = 0; i < walls.size(); ++i)
    walls[i].openings = openings_between(rasters[i], walls[i].s0, walls[i].s1, cut);

  std::vector<Fronts> fronts;
  for (WallRaster& raster : rasters) {
    const auto front = std::make_shared<const WallRaster>(std::move(raster));
    fronts.push_back({front, front});
  }

  // Lines are fitted again, for joined pieces have more points
  bridge_gaps(walls, fronts, cut);
  fit_sides(of.points, of.floor_m, executor, walls);
  join_corners(walls);
  meet_hidden_walls(walls);

  for (WallLine& wall : walls) {
    drop_gaps_at_doors(wall);
    for (auto* parts : {&wall.openings, &wall.gaps}) {
      std::sort(parts->begin(), parts->end(),
                [](const WallOpening& a, const WallOpening& b) { return a.s0 < b.s0; });
    }
  }
  return fronts;
}

/// Doors seen from both sides, then from one.
void add_doors(const PlanInput& of, const std::vector<Fronts>& fronts, const Cut& cut, WallPlan& plan) {
  plan.doors = doors_of(plan.walls);
  const std::vector<WallDoor> more = doors_between_sides(plan.walls, fronts, cut);
  plan.doors.insert(plan.doors.end(), more.begin(), more.end());
  find_far_sides(plan.walls, plan.doors);
  measure_doors(of.points, of.floor_m, plan.doors);
  take_back_doors(plan.doors, plan.walls);
}

/// Rooms of the free space between walls and closed doors; such rooms need not have a wall all around.
void add_open_rooms(const PlanInput& of, FreeSpace& space, WallPlan& plan) {
  std::vector<WallLine> closings = close_free_ends(of.points, of.floor_m, plan);
  for (const WallDoor& door : plan.doors) {
    WallDoor behind = door;
    behind.jambs = door.far_jambs;
    for (const WallDoor& side : {door, behind})
      closings.push_back(to_next_walls(closing_of(side), plan.walls));
  }
  plan.rooms = rooms_in(box_of(plan.walls), plan.walls, closings, plan.doors, space);
}

/// Leaves, windows, furniture and heights, which need the final walls.
void furnish_plan(const PlanInput& of, WallPlan& plan) {
  cut_walls_at(plan.doors, plan.walls);
  find_leaves(of.points, of.floor_m, plan.walls, plan.doors);
  const std::vector<WallDoor> windows = windows_of(of.points, of.floor_m, of.cut_m, plan.walls);
  cut_walls_at(windows, plan.walls);
  plan.doors.insert(plan.doors.end(), windows.begin(), windows.end());

  set_thickness(plan.walls);
  plan.furniture = furniture_outlines(of.points, of.floor_m, plan.walls);
  measure_heights(of.points, of.floor_m, plan.rooms);
}

}  // namespace

/// Moves a plan by a similarity, such as into world coordinates.
WallPlan moved(WallPlan plan, const Eigen::Matrix2d& linear, const Eigen::Vector2d& origin) {
  const double scale = linear.col(0).norm();
  const auto move = [&](Eigen::Vector2d& place) { place = origin + linear * place; };

  // Places along walls change with the origin
  for (WallLine& wall : plan.walls) {
    wall.normal = linear * wall.normal / scale;
    wall.offset_m = scale * wall.offset_m + wall.normal.dot(origin);
    const auto along = [&](double s) { return scale * s + wall.along().dot(origin); };
    wall.s0 = along(wall.s0);
    wall.s1 = along(wall.s1);

    for (auto* parts : {&wall.openings, &wall.gaps}) {
      for (WallOpening& part : *parts) part = {along(part.s0), along(part.s1)};
    }
  }

  // Places of doors, furniture and rooms
  for (WallDoor& door : plan.doors) {
    for (auto* jambs : {&door.jambs, &door.far_jambs}) std::for_each(jambs->begin(), jambs->end(), move);
  }

  for (auto& outline : plan.furniture) std::for_each(outline.begin(), outline.end(), move);
  for (WallRoom& room : plan.rooms) {
    std::for_each(room.outline.begin(), room.outline.end(), move);
    move(room.label);
  }
  return plan;
}

core::Result<WallPlan> find_walls(const PlanInput& of, const core::Executor& executor) {
  WallPlan plan;

  // Candidates for walls, of which some are furniture
  plan.walls = wall_sides(of.points, of.floor_m, of.cut_m, executor);
  drop_low_furniture(plan.walls);
  std::vector<WallRaster> rasters = rasters_of(plan.walls, of.points, of.floor_m);
  FreeSpace space(box_of(plan.walls), of.floor_m);
  plan.rays_known = static_cast<bool>(of.views);
  if (plan.rays_known) {
    if (auto seen = see_through_views(of, executor, space, rasters); !seen)
      return tl::unexpected(seen.error());
  }

  // Views decide between walls and furniture
  drop_furniture(plan.walls, rasters, plan.rays_known);
  const Cut cut = cut_at(of.cut_m, plan.rays_known);
  drop_leaves(plan.walls, rasters, cut);
  drop_loose_sides(plan.walls, rasters);
  cut_sides(plan.walls, rasters, cut);
  if (plan.walls.empty()) return plan;

  // Doors are openings of whole walls, and rooms end at them
  const std::vector<Fronts> fronts = join_sides(of, executor, cut, rasters, plan.walls);
  add_doors(of, fronts, cut, plan);
  if (plan.rays_known) {
    add_passages(of, fronts, cut, plan);
    add_open_rooms(of, space, plan);
  } else {
    plan.rooms = rooms_of(plan.walls);
  }

  furnish_plan(of, plan);
  return plan;
}

}  // namespace plumbline::plans
