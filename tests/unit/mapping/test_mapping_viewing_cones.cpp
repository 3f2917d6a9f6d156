// SPDX-License-Identifier: BSD-3-Clause
// Each term of the cone rule on made-up numbers.
#include <gtest/gtest.h>

#include <cmath>

#include "plumbline/mapping/local_mapping/viewing_cones.hpp"

namespace plumbline::mapping {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180.0;

TEST(ViewingCones, ZonesAreRingsOfTenDegrees) {
  EXPECT_EQ(viewing_zone(0.0), 0);
  EXPECT_EQ(viewing_zone(9.99 * kDegree), 0);
  EXPECT_EQ(viewing_zone(10.01 * kDegree), 1);
  EXPECT_EQ(viewing_zone(19.99 * kDegree), 1);
  EXPECT_EQ(viewing_zone(20.01 * kDegree), 2);
  EXPECT_EQ(viewing_zone(29.99 * kDegree), 2);
  EXPECT_EQ(viewing_zone(30.01 * kDegree), 3);
  EXPECT_EQ(viewing_zone(90.0 * kDegree), 3);
  EXPECT_EQ(viewing_zone(180.0 * kDegree), 3);
}

TEST(ViewingCones, AnglesAreAgainstTheNormal) {
  const Eigen::Vector3d point(1.0, 2.0, 3.0);
  const Eigen::Vector3d normal = -Eigen::Vector3d::UnitZ();
  const auto seen_from = [&](const Eigen::Vector3d& offset) {
    return viewing_angle(point, normal, point + offset) / kDegree;
  };
  EXPECT_NEAR(seen_from({0.0, 0.0, -2.0}), 0.0, 1e-9);
  EXPECT_NEAR(seen_from({2.0, 0.0, -2.0}), 45.0, 1e-9);
  EXPECT_NEAR(seen_from({0.0, -3.0, 0.0}), 90.0, 1e-9);
  EXPECT_NEAR(seen_from({0.0, 0.0, 1.0}), 180.0, 1e-9);
  EXPECT_TRUE(std::isfinite(seen_from({0.0, 0.0, 0.0}))) << "a camera in the point itself";
}

TEST(ViewingCones, TheThresholdFollowsItsEquations) {
  const ConeCounts first{200, 800, 20};
  const ConeCounts now{150, 700, 60};
  const ConeThreshold t = cone_threshold(now, first);
  EXPECT_NEAR(t.initial, 0.5 * (150.0 * 20.0 / 200.0 + 700.0 * 20.0 / 800.0), 1e-12);
  EXPECT_NEAR(t.theta, 0.25, 1e-12);
  EXPECT_NEAR(t.beta, 0.4 - 0.1, 1e-12);
  EXPECT_NEAR(t.alpha, 0.4 - 0.5, 1e-12);
  EXPECT_NEAR(t.adaptive, (1.0 + 0.25 - 0.3 + 0.1) * 16.25, 1e-12);
}

TEST(ViewingCones, EpsilonWeighsLostMatches) {
  const ConeThreshold t = cone_threshold({150, 700, 60}, {200, 800, 20}, 2.0);
  EXPECT_NEAR(t.adaptive, (1.0 + 2.0 * 0.25 - 0.3 + 0.1) * t.initial, 1e-12);
}

TEST(ViewingCones, WhatIsLeftInViewCanBeScaledFor) {
  const ConeCounts first{400, 1000, 0};
  const ConeCounts few{60, 1000, 12};  // a fifth of what is left in view has changed
  EXPECT_LT(few.changed, cone_threshold(few, first).adaptive);
  EXPECT_GT(few.changed, cone_threshold(few, first, 1.0, true).adaptive);
  EXPECT_EQ(cone_threshold(first, first, 1.0, true).initial, cone_threshold(first, first).initial);
}

TEST(ViewingCones, BalanceIsAskedForAsOneLikes) {
  const GridBalance even{0.8, 0.1};
  EXPECT_TRUE(balanced(even, Balance::kAbove));
  EXPECT_FALSE(balanced(even, Balance::kBelow));
  EXPECT_FALSE(balanced({}, Balance::kAbove));
  EXPECT_FALSE(balanced({}, Balance::kBelow)) << "nothing is counted";
  EXPECT_TRUE(balanced({}, Balance::kOff));
}

TEST(ViewingCones, EachTermPushesItsWay) {
  const ConeCounts first{200, 800, 20};
  const double usual = cone_threshold({200, 800, 50}, first).adaptive;
  // More changes lower what they must exceed; fewer matches and fewer points lower it through `initial`.
  EXPECT_LT(cone_threshold({200, 800, 120}, first).adaptive, usual);
  EXPECT_LT(cone_threshold({200, 600, 50}, first).adaptive, usual);
  // The same share of changes among fewer matches: theta raises what `initial` lost.
  const ConeThreshold fewer = cone_threshold({100, 800, 25}, first);
  EXPECT_GT(fewer.adaptive / fewer.initial, usual / cone_threshold({200, 800, 50}, first).initial);
}

TEST(ViewingCones, RightAfterAKeyframeNotAnyChangeFires) {
  const ConeCounts first{200, 800, 0};
  const ConeThreshold t = cone_threshold({200, 800, 5}, first);
  EXPECT_NEAR(t.initial, 10.0, 1e-12) << "D_r counts as a twentieth of the matches";
  EXPECT_GT(t.adaptive, 5.0);
  EXPECT_GT(40.0, cone_threshold({200, 800, 40}, first).adaptive) << "but a fifth does";
}

TEST(ViewingCones, NothingDividesByNothing) {
  for (const ConeCounts& first : {ConeCounts{}, ConeCounts{0, 100, 0}, ConeCounts{100, 0, 10}}) {
    for (const ConeCounts& now : {ConeCounts{}, ConeCounts{0, 100, 0}, ConeCounts{50, 0, 50}}) {
      const ConeThreshold t = cone_threshold(now, first);
      EXPECT_TRUE(std::isfinite(t.adaptive));
      EXPECT_TRUE(std::isfinite(t.theta) && std::isfinite(t.beta) && std::isfinite(t.alpha));
      const bool nothing_fires = now.matched > 0 || !(now.changed > t.adaptive);
      EXPECT_TRUE(nothing_fires) << "nothing matched, nothing changed";
    }
  }
}

TEST(ViewingCones, PixelsFallIntoTheirCells) {
  GridCounts grid{};
  count_in_grid({0.0, 0.0}, 640, 480, grid);
  count_in_grid({320.0, 240.0}, 640, 480, grid);
  count_in_grid({639.9, 479.9}, 640, 480, grid);
  count_in_grid({639.9, 10.0}, 640, 480, grid);
  count_in_grid({-5.0, 700.0}, 640, 480, grid);  // outside counts at the border
  EXPECT_EQ(grid, (GridCounts{1, 0, 1, 0, 1, 0, 1, 0, 1}));
}

TEST(ViewingCones, OppositeCornersAreIdeal) {
  const GridBalance b = grid_balance({50, 0, 0, 0, 0, 0, 0, 0, 50});
  EXPECT_NEAR(b.ecog, 1.0, 1e-12);
  EXPECT_NEAR(b.offset, 0.0, 1e-12);
}

TEST(ViewingCones, OneFullCellIsNoBalance) {
  const GridBalance b = grid_balance({0, 0, 80, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(b.ecog, 0.0);
  EXPECT_NEAR(b.offset, std::sqrt(2.0), 1e-12);
  const GridBalance nothing = grid_balance({});
  EXPECT_EQ(nothing.ecog, 0.0);
  EXPECT_EQ(nothing.offset, 0.0);
}

TEST(ViewingCones, OfEqualCellsTheFirstCounts) {
  // All equal: cells 0 and 1, a cell apart.
  const GridBalance b = grid_balance({7, 7, 7, 7, 7, 7, 7, 7, 7});
  EXPECT_NEAR(b.ecog, 1.0 / (2.0 * std::sqrt(2.0)), 1e-12);
  EXPECT_NEAR(b.offset, 0.0, 1e-12);
  // The fullest is cell 4; 2 and 6 come next and are equal: 2, a diagonal away.
  const GridBalance c = grid_balance({0, 0, 10, 0, 20, 0, 10, 0, 0});
  EXPECT_NEAR(c.ecog, std::sqrt(2.0) * 10.0 / (2.0 * std::sqrt(2.0) * 20.0), 1e-12);
}

TEST(ViewingCones, TheCentreOfMassIsInCells) {
  const GridBalance b = grid_balance({0, 0, 30, 0, 10, 0, 0, 0, 0});  // (1, -1) three times, (0, 0) once
  EXPECT_NEAR(b.offset, 0.75 * std::sqrt(2.0), 1e-12);
  EXPECT_LT(b.ecog, b.offset) << "one-sided: no keyframe";
}

}  // namespace
}  // namespace plumbline::mapping
