// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "evaluate_worlds.hpp"
#include "plumbline/evaluate/wall_planes.hpp"

namespace {

using namespace plumbline;
using namespace plumbline::evaluate;
using namespace plumbline::evaluate::worlds;

std::vector<WallPlane> planes_of(const SurfaceSamples& cloud, double spacing, int count) {
  const WallThicknessOptions wall;
  WallPlanesOptions options;
  options.planes = count;
  return wall_planes(cloud, wall_patches(cloud, spacing, wall, core::Executor(2)), wall.patch_m, options);
}

TEST(WallPlanes, OfARoomAreItsSidesByArea) {
  for (const bool tilted : {false, true}) {
    SCOPED_TRACE(tilted);
    const SurfaceSamples room = box({4.0, 3.0, 2.0}, 0.02);
    const auto planes = planes_of(tilted ? moved(room, tilt()) : room, 0.02, 100);
    ASSERT_EQ(planes.size(), 6U);
    const double areas[] = {12.0, 12.0, 8.0, 8.0, 6.0, 6.0};
    for (std::size_t i = 0; i < planes.size(); ++i) {
      EXPECT_NEAR(planes[i].area_m2, areas[i], 0.35 * areas[i]);  // patches at the borders count or do not
      EXPECT_LT(planes[i].straightness_mm, 0.01);
      EXPECT_LT(planes[i].slab_rms_mm, 0.01);
      EXPECT_LT(planes[i].thickness.rms_mm, 0.01);
    }
  }
}

TEST(WallPlanes, ADoubledWallIsThick) {
  SurfaceSamples cloud = plane(2.0, 0.0, 0.01);
  append(cloud, plane(2.0, 0.03, 0.01));
  const auto planes = planes_of(moved(cloud, tilt()), 0.01, 3);
  ASSERT_GE(planes.size(), 1U);
  EXPECT_NEAR(planes[0].thickness.rms_mm, 30.0, 0.1);
  EXPECT_GT(planes[0].thickness.layered_percent, 95.0);
  EXPECT_GT(planes[0].slab_rms_mm, 14.9);
}

TEST(WallPlanes, AWallThatGoesOnBesideItselfIsNotStraight) {
  SurfaceSamples cloud;
  add_rectangle(cloud, {0, 0, 0}, {2, 0, 0}, {0, 2, 0}, 0.01);
  add_rectangle(cloud, {2, 0, 0.03}, {2, 0, 0}, {0, 2, 0}, 0.01);
  const auto planes = planes_of(cloud, 0.01, 1);
  ASSERT_EQ(planes.size(), 1U);
  EXPECT_NEAR(planes[0].area_m2, 8.0, 0.8);
  EXPECT_LT(planes[0].thickness.median_mm, 1.0);  // single everywhere but for the step
  EXPECT_GT(planes[0].straightness_mm, 3.0);      // the plane leans over the step and is off on both sides
}

TEST(WallPlanes, HandlesDoNotMakeAFrontThick) {
  SurfaceSamples front = plane(2.0, 0.0, 0.01);
  for (double x : {0.3, 0.9, 1.5}) add_rectangle(front, {x, 0.4, 0.03}, {0.15, 0, 0}, {0, 0.02, 0}, 0.005);
  const auto planes = planes_of(front, 0.01, 1);
  ASSERT_EQ(planes.size(), 1U);
  EXPECT_LT(planes[0].thickness.rms_mm, 0.1);
  EXPECT_LT(planes[0].straightness_mm, 0.1);
  EXPECT_GT(planes[0].slab_rms_mm, 1.0);  // which is why the points' own spread is told apart
}

TEST(WallPlanes, WithoutPatchesThereAreNone) {
  EXPECT_TRUE(planes_of(SurfaceSamples(), 0.01, 3).empty());
  EXPECT_TRUE(planes_of(plane(2.0, 0.0, 0.01), 0.01, 0).empty());
}

}  // namespace
