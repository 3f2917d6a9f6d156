// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "ros2/live_grid.hpp"

namespace plumbline::net {
namespace {

using geometry::Rigid3;

constexpr std::uint8_t kFree = 0;
constexpr std::uint8_t kOccupied = 100;
constexpr std::uint8_t kUnknown = 255;

/// A camera 1 m over the floor that looks along x.
Rigid3 looking_along_x(const Eigen::Vector2d& at) {
  Rigid3 pose;
  pose.rotation << 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0;
  pose.translation = {at.x(), at.y(), 1.0};
  return pose;
}

/// The floor from 0.6 m to 3 m ahead of a place, and a wall behind it, of 0.8 m to both sides.
std::vector<Eigen::Vector3f> room(double x0) {
  std::vector<Eigen::Vector3f> points;
  const auto x = static_cast<float>(x0);
  for (float y = -0.8F; y < 0.8F; y += 0.02F) {
    for (float d = 0.6F; d < 3.0F; d += 0.02F) points.emplace_back(x + d, y, 0.01F);
    for (float z = 0.0F; z < 2.0F; z += 0.05F) points.emplace_back(x + 3.02F, y, z);
  }
  points.emplace_back(NAN, 0.0F, 0.0F);
  return points;
}

/// Value at a place of the last whole grid.
std::uint8_t value(const dataset::GridCells& grid, double x, double y) {
  const int column = static_cast<int>(std::floor((x - grid.origin.x()) / grid.resolution_m));
  const int row = static_cast<int>(std::floor((y - grid.origin.y()) / grid.resolution_m));
  return grid.cells.at(static_cast<std::size_t>(row) * grid.width + static_cast<std::size_t>(column));
}

TEST(LiveGrid, FloorIsFreeWallsAreOccupiedTheRestIsUnknown) {
  LiveGrid grid({});
  grid.add(1.0, looking_along_x({0.0, 0.0}), room(0.0));
  const auto change = grid.take();
  ASSERT_TRUE(change);
  ASSERT_TRUE(change->whole);
  const dataset::GridCells& cells = change->cells;
  ASSERT_EQ(cells.cells.size(), cells.width * cells.height);
  EXPECT_EQ(value(cells, 1.5, 0.2), kFree);
  EXPECT_EQ(value(cells, 3.03, 0.2), kOccupied);
  EXPECT_EQ(value(cells, 3.5, 0.2), kUnknown) << "behind the wall";
  EXPECT_EQ(value(cells, -1.0, 0.0), kUnknown) << "behind the camera";
  EXPECT_EQ(value(cells, 0.0, 0.1), kFree) << "where the camera was carried";
  EXPECT_EQ(value(cells, 0.4, 0.0), kUnknown) << "floor below the field of view";
  EXPECT_FALSE(grid.take()) << "nothing has changed";
}

TEST(LiveGrid, AScanFollowsItsKeyframe) {
  LiveGrid grid({});
  grid.add(1.0, looking_along_x({0.0, 0.0}), room(0.0));
  ASSERT_TRUE(grid.take());
  grid.move({{1.0, looking_along_x({0.3, 0.0})}});
  const auto change = grid.take();
  ASSERT_TRUE(change);
  EXPECT_FALSE(change->whole) << "the part that has changed";
  EXPECT_LT(change->cells.width, 100U);

  // The part lies in the whole grid by its first column and row.
  const dataset::GridCells& part = change->cells;
  dataset::GridCells shifted = part;
  shifted.origin += part.resolution_m * Eigen::Vector2d(part.x, part.y);
  EXPECT_EQ(value(shifted, 3.33, 0.2), kOccupied);
  EXPECT_EQ(value(shifted, 3.03, 0.2), kFree);
}

TEST(LiveGrid, WhatWasTakenAwayBecomesFree) {
  LiveGrid grid({});
  std::vector<Eigen::Vector3f> with_box = room(0.0);
  for (float y = -0.1F; y < 0.1F; y += 0.01F) {
    for (float z = 0.0F; z < 0.4F; z += 0.02F) with_box.emplace_back(1.52F, y, z);
  }
  grid.add(1.0, looking_along_x({0.0, 0.0}), with_box);
  const auto before = grid.take();
  EXPECT_EQ(value(before->cells, 1.53, 0.0), kOccupied);

  for (int i = 0; i < 4; ++i) grid.add(2.0 + i, looking_along_x({0.0, 0.0}), room(0.0));
  const auto part = grid.take();
  ASSERT_TRUE(part);
  dataset::GridCells shifted = part->cells;
  shifted.origin += shifted.resolution_m * Eigen::Vector2d(shifted.x, shifted.y);
  EXPECT_EQ(value(shifted, 1.53, 0.0), kFree);
}

TEST(LiveGrid, GrowsWithThePath) {
  LiveGrid grid({});
  grid.add(1.0, looking_along_x({0.0, 0.0}), room(0.0));
  ASSERT_TRUE(grid.take());
  grid.add(2.0, looking_along_x({-20.0, 0.0}), room(-20.0));
  const auto change = grid.take();
  ASSERT_TRUE(change);
  EXPECT_TRUE(change->whole);
  EXPECT_EQ(value(change->cells, 3.03, 0.2), kOccupied) << "the first scan is still where it was";
  EXPECT_EQ(value(change->cells, -16.97, 0.2), kOccupied);
}

}  // namespace
}  // namespace plumbline::net
