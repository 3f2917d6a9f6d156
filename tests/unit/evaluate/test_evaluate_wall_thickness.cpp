// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "evaluate_worlds.hpp"
#include "plumbline/evaluate/wall_thickness.hpp"

namespace {

using namespace plumbline;
using namespace plumbline::evaluate;
using namespace plumbline::evaluate::worlds;

WallThickness thickness(const SurfaceSamples& cloud, double spacing) {
  return thickness_of(wall_patches(cloud, spacing, {}, core::Executor(2)));
}

TEST(WallThickness, OfATruePlaneIsZero) {
  const WallThickness wall = thickness(moved(plane(2.0, 0.0, 0.01), tilt()), 0.01);
  EXPECT_GE(wall.patches, 50U);
  EXPECT_LT(wall.rms_mm, 0.01);
  EXPECT_EQ(wall.layered_percent, 0.0);
}

TEST(WallThickness, OfTwoSheetsIsTheirSpacing) {
  for (const double spacing : {0.001, 0.005, 0.012, 0.020, 0.026, 0.030, 0.041, 0.060, 0.100}) {
    for (const bool normals : {true, false}) {
      for (const bool tilted : {true, false}) {
        SCOPED_TRACE(spacing);
        SurfaceSamples cloud = plane(1.2, 0.0, 0.01);
        append(cloud,
               plane(1.2, spacing, 0.01));  // not tilted, the voxels' border at 0 parts them from below
        if (!normals) cloud.normals.clear();
        const WallThickness wall = thickness(tilted ? moved(cloud, tilt()) : cloud, 0.01);
        EXPECT_GE(wall.patches, 20U);
        EXPECT_NEAR(wall.rms_mm, 1000.0 * spacing, 0.01 + 0.002 * 1000.0 * spacing);
        EXPECT_GT(wall.layered_percent, 95.0);
      }
    }
  }
}

TEST(WallThickness, SheetsOnBothSidesOfAVoxelBorder) {
  SurfaceSamples cloud = plane(1.2, 0.25 - 0.008, 0.01);
  append(cloud, plane(1.2, 0.25 + 0.008, 0.01));
  EXPECT_NEAR(thickness(cloud, 0.01).rms_mm, 16.0, 0.01);
}

TEST(WallThickness, AThinSecondSheetCountsWithTheWholeSpacing) {
  SurfaceSamples cloud = plane(1.2, 0.0, 0.005);
  append(cloud, plane(1.2, 0.03, 0.01));  // a quarter as dense
  const WallThickness wall = thickness(cloud, 0.005);
  EXPECT_NEAR(wall.rms_mm, 30.0, 0.05);
}

TEST(WallThickness, OfANoisyWallIsItsNoise) {
  for (const double sigma : {0.002, 0.005, 0.010}) {
    SCOPED_TRACE(sigma);
    Random random(7);
    SurfaceSamples cloud = plane(1.6, 0.0, 0.005);
    cloud.normals.clear();
    for (auto& p : cloud.points) p.z() += static_cast<float>(sigma * random.gauss());
    const WallThickness wall = thickness(moved(cloud, tilt()), 0.005);
    EXPECT_NEAR(wall.rms_mm, 1000.0 * sigma, 60.0 * sigma);
    EXPECT_LT(wall.layered_percent, 1.0);
  }
}

TEST(WallThickness, NoisyDoubledWall) {
  Random random(8);
  SurfaceSamples cloud = plane(2.0, 0.0, 0.007);
  append(cloud, plane(2.0, 0.04, 0.007));
  for (auto& p : cloud.points) p.z() += static_cast<float>(0.003 * random.gauss());
  const WallThickness wall = thickness(cloud, 0.005);
  EXPECT_NEAR(wall.rms_mm, std::sqrt(40.0 * 40.0 + 9.0), 0.5);
  EXPECT_GT(wall.layered_percent, 95.0);
}

TEST(WallThickness, CornersOfARoomAreNotThick) {
  for (const bool normals : {true, false}) {
    SurfaceSamples room = moved(box({2.1, 1.7, 1.3}, 0.01), tilt());
    if (!normals) room.normals.clear();
    const WallThickness wall = thickness(room, 0.01);
    EXPECT_GT(wall.patches, 100U);
    EXPECT_LT(wall.median_mm, 0.01);
    EXPECT_LT(wall.p90_mm, normals ? 0.01 : 0.5);
    EXPECT_LT(wall.rms_mm, normals ? 0.01 : 1.0);
  }
}

TEST(WallThickness, ThinBoardSeenFromBothSidesIsTwoSurfaces) {
  SurfaceSamples board = plane(1.0, 0.0, 0.01);
  SurfaceSamples back = plane(1.0, 0.03, 0.01);
  for (auto& n : back.normals) n = -n;
  append(board, back);
  EXPECT_LT(thickness(board, 0.01).rms_mm, 0.01);
}

TEST(WallThickness, OneBadWallShowsAmongGoodOnes) {
  SurfaceSamples room = box({2.0, 2.0, 2.0}, 0.01);
  add_rectangle(room, {0, 0, 0.05}, {2, 0, 0}, {0, 2, 0}, 0.01);  // the floor twice
  const WallThickness wall = thickness(room, 0.01);
  EXPECT_GT(wall.layered_percent, 8.0);
  EXPECT_LT(wall.layered_percent, 30.0);
  EXPECT_GT(wall.rms_mm, 14.0);
  EXPECT_LT(wall.median_mm, 0.01);
}

TEST(WallThickness, CoarseCloudsGetLargerCells) {
  SurfaceSamples cloud = plane(2.0, 0.0, 0.025);
  append(cloud, plane(2.0, 0.03, 0.025));
  EXPECT_NEAR(thickness(cloud, 0.025).rms_mm, 30.0, 0.1);
}

TEST(WallThickness, ScatterAndFewPointsHaveNoWalls) {
  Random random(5);
  SurfaceSamples scatter;
  for (int i = 0; i < 20000; ++i) {
    scatter.points.emplace_back(Eigen::Vector3d(random(), random(), random()).cast<float>());
  }
  EXPECT_EQ(thickness(scatter, 0.02).patches, 0U);
  EXPECT_EQ(thickness({}, 0.0).patches, 0U);
  SurfaceSamples one;
  one.points = {{1, 1, 1}};
  EXPECT_EQ(thickness(one, 0.0).patches, 0U);
  SurfaceSamples line;
  for (int i = 0; i < 5000; ++i) line.points.emplace_back(0.001F * static_cast<float>(i), 0.0F, 0.0F);
  EXPECT_EQ(thickness(line, 0.001).patches, 0U);
}

}  // namespace
