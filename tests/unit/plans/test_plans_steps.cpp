// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <tuple>
#include <vector>

#include "room_cells.hpp"
#include "wall_steps.hpp"

namespace plumbline::plans {
namespace {

/// A face of a wall, its front on the right of the way.
WallLine face(const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  const Eigen::Vector2d along = (to - from).normalized();
  WallLine wall;
  wall.normal = {along.y(), -along.x()};
  wall.offset_m = wall.normal.dot(from);
  wall.s0 = along.dot(from);
  wall.s1 = along.dot(to);
  return wall;
}

/// Area of an outline less that of its holes.
double solid_area(const WallSolid& solid) {
  double area = 0.0;
  for (const auto& ring : solid.rings) area += area_of(ring);
  return area;
}

TEST(PlanSolids, FillBetweenFacesAndAssumeTheRest) {
  WallPlan plan;
  plan.walls = {face({0, 0}, {4, 0}), face({3, 0.2}, {0, 0.2})};
  const std::vector<WallSolid> solids = wall_solids(plan, 1.0);
  ASSERT_EQ(solids.size(), 2U);
  EXPECT_FALSE(solids[0].assumed);
  EXPECT_NEAR(solid_area(solids[0]), 3.0 * 0.2, 1e-3);
  EXPECT_TRUE(solids[1].assumed);
  EXPECT_NEAR(solid_area(solids[1]), 1.0 * 0.1, 1e-3);
}

TEST(PlanOpenings, AreTurnedWithThePlan) {
  WallPlan plan;
  plan.walls.resize(1);
  plan.walls[0].offset_m = 2.0;
  plan.walls[0].s0 = -1.0;
  plan.walls[0].s1 = 3.0;
  plan.walls[0].openings = {{0.0, 1.0}};
  plan.rooms.resize(1);
  plan.rooms[0].label = {1.0, 2.0};
  const Eigen::Matrix2d linear = 2.0 * Eigen::Rotation2Dd(0.3).toRotationMatrix();
  const Eigen::Vector2d origin(500.0, 7000.0);
  const WallPlan there = moved(plan, linear, origin);
  for (const auto& [before, after] :
       {std::pair(-1.0, there.walls[0].s0), std::pair(1.0, there.walls[0].openings[0].s1)})
    EXPECT_LT((there.walls[0].at(after) - origin - linear * plan.walls[0].at(before)).norm(), 1e-9);
  EXPECT_LT((there.rooms[0].label - origin - linear * plan.rooms[0].label).norm(), 1e-9);
}

/// The room of 4 x 3 m whose wall at x = 4 is seen from y = 0 up to a height, looked through from its middle.
std::vector<WallRoom> room_seen_up_to(double y) {
  const std::vector<WallLine> walls = {face({0, 0}, {0, 3}), face({0, 3}, {4, 3}), face({4, y}, {4, 0}),
                                       face({4, 0}, {0, 0})};
  const Eigen::AlignedBox2d box(Eigen::Vector2d(-1.5, -1.5), Eigen::Vector2d(5.5, 4.5));
  FreeSpace space(box, 0.0);
  for (int view = 0; view < 3; ++view) {
    maps::ViewRays rays;
    rays.origin = {1.9 + 0.1 * view, 1.5, 1.4};
    for (int k = 0; k < 720; ++k) {
      const Eigen::Vector2d way(std::cos(k * M_PI / 360.0), std::sin(k * M_PI / 360.0));
      const double x = (way.x() > 0 ? 4.0 - rays.origin.x() : -rays.origin.x()) / way.x();
      const double far = std::min(x, (way.y() > 0 ? 1.5 : -1.5) / way.y());
      rays.ends.emplace_back((rays.origin + far * Eigen::Vector3d(way.x(), way.y(), 0)).cast<float>());
    }
    space.add(rays);
  }
  return rooms_in(box, walls, {}, {}, space);
}

/// The face, at y = 0 and seen from y > 0, of a wall of 4 m with a hole from 1 m to 1 m + `width`. Cameras
/// look through the hole above `sill_m`; what stands before it hides what is lower, and `leaf_m` of the hole
/// beside.
WallRaster wall_with_hole(double width, double sill_m, double leaf_m) {
  WallRaster raster(Eigen::Vector2d::UnitY(), 0.0, -4.0, 0.0, 0.0);  // s = -x
  for (double x = 0.01; x < 4.0; x += 0.01) {
    for (double z = 0.025; z < 2.5; z += 0.025) {
      const bool hole = x > 1.0 && x < 1.0 + width && z < 2.05;
      const bool hidden = hole && (z < sill_m || x > 1.0 + width - leaf_m);
      if (!hole) raster.add_surface({x, 0.0, z});
      maps::ViewRays ray;
      ray.origin = {x, 1.0, z};
      ray.ends = {Eigen::Vector3d(x, hidden ? 0.06 : -1.0, z).cast<float>()};
      if (hole) raster.add_rays(ray);
    }
  }
  return raster;
}

TEST(PlanOpenings, AreOpenBelowSillsToo) {
  const Cut cut{1.2, 0.9, 2.0, true};
  EXPECT_EQ(openings_between(wall_with_hole(0.9, 0.0, 0.0), -4.0, 0.0, cut).size(), 1U);
  EXPECT_TRUE(
      openings_between(wall_with_hole(0.9, 0.85, 0.0), -4.0, 0.0, cut).empty());  // a bed before a window
}

TEST(PlanOpenings, MayBeWiderThanDoors) {
  const Cut cut{1.2, 0.9, 2.0, true};
  EXPECT_EQ(openings_between(wall_with_hole(2.6, 0.0, 0.0), -4.0, 0.0, cut).size(), 1U);
}

TEST(PlanOpenings, EndWhereASlidingLeafHidesTheWall) {
  const Cut cut{1.2, 0.9, 2.0, true};
  const auto found = openings_between(wall_with_hole(1.7, 0.0, 0.8), -4.0, 0.0, cut);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_NEAR(found.front().s1 - found.front().s0, 0.9, 0.05);
}

/// A side at y = 0, 2 m long and seen up to `top_m`, over which cameras looked or not.
WallRaster side_up_to(double top_m, bool looked_over) {
  WallRaster raster(Eigen::Vector2d::UnitY(), 0.0, -3.0, 1.0, 0.0);  // s = -x
  for (double x = 0.01; x < 2.0; x += 0.01) {
    for (double z = 0.025; z < top_m; z += 0.025) raster.add_surface({x, 0.0, z});
    maps::ViewRays ray;
    ray.origin = {x, 2.0, 1.4};
    ray.ends = {Eigen::Vector3d(x, -0.5, top_m + 0.3).cast<float>()};
    if (looked_over) raster.add_rays(ray);
  }
  return raster;
}

TEST(PlanFurniture, IsWhatCamerasLookedOver) {
  for (const bool looked_over : {false, true}) {
    std::vector<WallLine> walls = {face({2, 0}, {0, 0})};
    std::vector<WallRaster> rasters = {side_up_to(1.8, looked_over)};
    drop_furniture(walls, rasters, true);
    EXPECT_EQ(walls.empty(), looked_over) << "the upper part of a wall may be unseen";
    EXPECT_EQ(rasters.size(), walls.size());
  }
}

TEST(PlanFurniture, LeavesHangAtAJambOfAnOpeningOfTheirWidth) {
  const Cut cut{1.2, 0.9, 2.0, true};
  for (const auto& [x, length, leaf] : {std::tuple(1.02, 0.88, true), std::tuple(1.88, 0.75, true),
                                        std::tuple(1.02, 1.25, false), std::tuple(2.6, 0.88, false)}) {
    std::vector<WallLine> walls = {face({4, 0}, {0, 0}), face({x, 0.03}, {x, length})};
    std::vector<WallRaster> rasters = {wall_with_hole(0.9, 0.0, 0.0), side_up_to(2.0, false)};
    drop_leaves(walls, rasters, cut);
    EXPECT_EQ(walls.size(), leaf ? 1U : 2U) << x << ", " << length;
  }
}

TEST(PlanFurniture, SidesWithAnotherFaceBehindAreWallsBesideADoor) {
  std::vector<WallLine> walls = {face({4, 0}, {0, 0}), face({1.02, 0.03}, {1.02, 0.88}),
                                 face({0.92, 0.88}, {0.92, 0.03})};
  std::vector<WallRaster> rasters = {wall_with_hole(0.9, 0.0, 0.0), side_up_to(2.0, false),
                                     side_up_to(2.0, false)};
  drop_leaves(walls, rasters, {1.2, 0.9, 2.0, true});
  EXPECT_EQ(walls.size(), 3U);
}

/// Faces on one line with 2.5 m and 3.2 m between them, and what cameras saw from y > 0 of the gaps, except
/// from x = 2 m on for `hidden_m`.
std::vector<WallDoor> wide_passages(double hidden_m) {
  const std::vector<WallLine> walls = {face({9, 0}, {8.2, 0}), face({5, 0}, {3.5, 0}), face({1, 0}, {0, 0})};
  const auto raster = std::make_shared<WallRaster>(Eigen::Vector2d::UnitY(), 0.0, -12.0, 3.0, 0.0);  // s = -x
  for (double x = 0.01; x < 9.0; x += 0.01) {
    for (double z = 0.025; z < 2.5; z += 0.025) {
      maps::ViewRays ray;
      ray.origin = {x, 1.0, z};
      ray.ends = {Eigen::Vector3d(x, -1.0, z).cast<float>()};
      const bool wall = x < 1.0 || (x > 3.5 && x < 5.0) || x > 8.2;
      if (wall) raster->add_surface({x, 0.0, z});
      if (!wall && !(x > 2.0 && x < 2.0 + hidden_m)) raster->add_rays(ray);
    }
  }
  return passages_in_line(walls, {3, Fronts{raster, raster}}, {1.2, 0.9, 2.0, true}, {});
}

TEST(PlanOpenings, WideOnesLieBetweenFacesInLine) {
  const std::vector<WallDoor> found = wide_passages(0.0);
  ASSERT_EQ(found.size(), 1U) << "none is wider than 3 m";
  EXPECT_NEAR(found[0].width_m, 2.5, 1e-9);
  EXPECT_EQ(wide_passages(0.2).size(), 1U) << "a post";
  EXPECT_TRUE(wide_passages(0.5).empty()) << "perhaps wall between two doors";
}

TEST(PlanOpenings, BetweenPiecesOfAWallEndWhereNoRayCrossed) {
  const auto raster = std::make_shared<WallRaster>(Eigen::Vector2d::UnitY(), 0.0, -6.0, 2.0, 0.0);  // s = -x
  for (double x = 0.01; x < 4.0; x += 0.01) {
    for (double z = 0.025; z < 2.5; z += 0.025) {
      maps::ViewRays ray;
      ray.origin = {x, 1.0, z};
      ray.ends = {Eigen::Vector3d(x, -1.0, z).cast<float>()};
      if (x < 1.0 || x > 2.6) raster->add_surface({x, 0.0, z});
      if (x > 1.0 && x < 1.8 && z < 2.05) raster->add_rays(ray);
    }
  }
  std::vector<WallLine> walls = {face({4, 0}, {2.6, 0}), face({1, 0}, {0, 0})};
  std::vector<Fronts> fronts(2, Fronts{raster, raster});
  bridge_gaps(walls, fronts, {1.2, 0.9, 2.0, true});
  ASSERT_EQ(walls.size(), 1U);
  ASSERT_EQ(walls[0].openings.size(), 1U);
  EXPECT_NEAR(walls[0].openings[0].s0, -1.8, 0.05) << "beyond there may be wall that was not seen";
  EXPECT_NEAR(walls[0].openings[0].s1, -1.0, 0.05);
}

TEST(PlanCorners, AreBeforeFacesNotBehindThem) {
  for (const bool before : {true, false}) {  // the side of a shelf that was seen through a door is behind
    std::vector<WallLine> walls = {face({4, 0}, {0, 0}),
                                   before ? face({2, 0.1}, {2, 0.6}) : face({2, -0.1}, {2, -0.6})};
    join_corners(walls);
    EXPECT_EQ(walls[1].corner[0] >= 0 || walls[1].corner[1] >= 0, before);
  }
}

TEST(PlanFurniture, PiecesOfAWallNeedNoLongWall) {
  for (const double high : {0.0, 1.0}) {
    std::vector<WallLine> walls = {face({0, 0}, {0.5, 0.07}), face({1.5, 0.21}, {1.9, 0.266})};
    for (WallLine& wall : walls) wall.high = high;
    std::vector<WallRaster> rasters(2, side_up_to(2.5, false));
    drop_loose_sides(walls, rasters);
    EXPECT_EQ(walls.size(), high > 0.0 ? 2U : 0U);
  }
}

TEST(PlanRooms, CloseOverShortGapsOnly) {
  for (const double y : {3.0, 2.5, 1.5}) {
    const std::vector<WallRoom> rooms = room_seen_up_to(y);
    ASSERT_EQ(rooms.size(), 1U) << y;
    EXPECT_NEAR(rooms[0].area_m2, 12.0, 0.01) << y;
    EXPECT_NEAR(rooms[0].perimeter_m(), 14.0, 0.01) << y;
    EXPECT_EQ(rooms[0].closed, y > 2.0) << y;
    const auto gaps = std::count(rooms[0].sides.begin(), rooms[0].sides.end(), RoomSide::kGap);
    EXPECT_EQ(gaps, y == 2.5 ? 1 : 0) << y;
  }
}

}  // namespace
}  // namespace plumbline::plans
