// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "plumbline/geometry/line_triangulation.hpp"
#include "random_world.hpp"

namespace plumbline::geometry {
namespace {

using tests::Random;
using Status = LineTriangulationStatus;

constexpr double kSigma = 0.6 / 525.0;

struct Segment {
  Eigen::Vector3d start;
  Eigen::Vector3d end;
};

LineView view_of(const Segment& s, const Rigid3& camera_from_world) {
  return {camera_from_world, (camera_from_world * s.start).hnormalized(),
          (camera_from_world * s.end).hnormalized(), kSigma};
}

/// Cameras beside each other that look along z.
Rigid3 camera_at(const Eigen::Vector3d& centre, double turn = 0.0) {
  const Eigen::Matrix3d r = exp_so3({0.0, turn, 0.0});
  return {r, -(r * centre)};
}

double off_line(const PluckerLine& line, const Eigen::Vector3d& p) {
  return (nearest_point(line, p) - p).norm();
}

const Segment kUpright{{0.2, -0.5, 2.0}, {0.3, 0.5, 2.2}};

TEST(LineTriangulation, TwoExactViewsGiveTheLineAndItsEnds) {
  Random random(3);
  int solved = 0;
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d middle(random.uniform(-0.5, 0.5), random.uniform(-0.4, 0.4),
                                 random.uniform(1.0, 4.0));
    const Eigen::Vector3d half = 0.3 * random.direction();
    const Segment s{middle - half, middle + half};
    const Rigid3 world = random.pose(3.0, 30.0);  // any frame will do
    const Rigid3 a = world;
    const Rigid3 b = random.step(0.4, 0.1) * world;
    const Rigid3 world_from_a = a.inverse();
    const Segment moved{world_from_a * s.start, world_from_a * s.end};
    const TriangulatedLine result = triangulate_line({view_of(moved, a), view_of(moved, b)});
    if (!result.ok()) continue;
    ++solved;
    EXPECT_LT((result.start - moved.start).norm(), 1e-7);
    EXPECT_LT((result.end - moved.end).norm(), 1e-7);
    EXPECT_LT(off_line(result.line, moved.start), 1e-7);
    EXPECT_NEAR(result.line.v.norm(), 1.0, 1e-12);
    EXPECT_NEAR(result.line.v.dot((moved.end - moved.start).normalized()), 1.0, 1e-9);
    EXPECT_LT(result.rms, 1e-6);
  }
  EXPECT_GT(solved, 100) << "the others look along the line or moved along it";
}

TEST(LineTriangulation, EndsNeedNotBeTheSamePoints) {
  const Rigid3 a = camera_at({0, 0, 0});
  const Rigid3 b = camera_at({0.3, 0, 0});
  const Eigen::Vector3d along = kUpright.end - kUpright.start;
  const Segment part{kUpright.start + 0.3 * along, kUpright.end + 0.4 * along};
  const TriangulatedLine result = triangulate_line({view_of(kUpright, a), view_of(part, b)});
  ASSERT_TRUE(result.ok());
  EXPECT_LT((result.start - kUpright.start).norm(), 1e-8) << "ends are those of the first view";
  EXPECT_LT((result.end - kUpright.end).norm(), 1e-8);
}

TEST(LineTriangulation, SigmaTellsTheSpread) {
  Random random(11);
  std::vector<LineView> exact;
  for (int i = 0; i < 4; ++i)
    exact.push_back(view_of(kUpright, camera_at({0.08 * i, 0.02 * i, 0.03 * i}, -0.02 * i)));
  const TriangulatedLine truth = triangulate_line(exact);
  ASSERT_TRUE(truth.ok());
  double squared = 0.0;
  double rms = 0.0;
  int solved = 0;
  constexpr int kTrials = 400;
  for (int i = 0; i < kTrials; ++i) {
    std::vector<LineView> views = exact;
    for (LineView& v : views) {
      v.start += kSigma * Eigen::Vector2d(random.normal(), random.normal());
      v.end += kSigma * Eigen::Vector2d(random.normal(), random.normal());
    }
    const TriangulatedLine result = triangulate_line(views);
    if (!result.ok()) continue;  // an end beyond three standard deviations
    ++solved;
    squared += std::pow(result.start.z() - kUpright.start.z(), 2);
    rms += result.rms;
  }
  EXPECT_GT(solved, 380);
  const double spread = std::sqrt(squared / solved);
  EXPECT_GT(spread, 0.8 * truth.start_sigma);
  EXPECT_LT(spread, 1.25 * truth.start_sigma);
  EXPECT_GT(spread, 0.002) << "noise that does nothing proves nothing";
  EXPECT_NEAR(rms / solved, 1.0, 0.15);
}

TEST(LineTriangulation, ManyViewsAreBetterThanTwo) {
  std::vector<LineView> views;
  for (int i = 0; i < 8; ++i) views.push_back(view_of(kUpright, camera_at({0.04 * i, 0, 0})));
  const TriangulatedLine two = triangulate_line({views.front(), views.back()});
  const TriangulatedLine all = triangulate_line(views);
  ASSERT_TRUE(two.ok() && all.ok());
  EXPECT_LT(all.start_sigma, 0.95 * two.start_sigma);
}

TEST(LineTriangulation, MovingAlongTheLineTellsNothing) {
  const Segment level{{-0.5, 0.3, 2.0}, {0.5, 0.3, 2.0}};
  const TriangulatedLine along =
      triangulate_line({view_of(level, camera_at({0, 0, 0})), view_of(level, camera_at({0.5, 0, 0}))});
  EXPECT_EQ(along.status, Status::kTooLittleParallax);
  const TriangulatedLine turned =
      triangulate_line({view_of(level, camera_at({0, 0, 0})), view_of(level, camera_at({0, 0, 0}, 0.3))});
  EXPECT_EQ(turned.status, Status::kTooLittleParallax);
  const TriangulatedLine across =
      triangulate_line({view_of(level, camera_at({0, 0, 0})), view_of(level, camera_at({0, 0.5, 0}))});
  EXPECT_TRUE(across.ok());
}

TEST(LineTriangulation, WhatIsFarForItsBaselineIsRefused) {
  const Segment far{{0.0, -4.0, 20.0}, {0.0, 4.0, 20.0}};
  LineTriangulationOptions options;
  options.min_angle_rad = 0.0;
  const auto views = {view_of(far, camera_at({0, 0, 0})), view_of(far, camera_at({0.1, 0, 0}))};
  EXPECT_EQ(triangulate_line(views, options).status, Status::kUncertain);
  options.max_relative_sigma = 1e9;
  EXPECT_TRUE(triangulate_line(views, options).ok());
  options.max_depth_m = 15.0;
  EXPECT_EQ(triangulate_line(views, options).status, Status::kOutOfRange);
}

TEST(LineTriangulation, PlanesThatMeetBehindTheCamerasAreRefused) {
  const Segment left{{-0.3, -0.5, 2.0}, {-0.3, 0.5, 2.0}};
  const Segment right{{0.3, -0.5, 2.0}, {0.3, 0.5, 2.0}};
  // The left camera sees the left line and the right camera the right one: the planes diverge.
  const TriangulatedLine result =
      triangulate_line({view_of(left, camera_at({-0.1, 0, 0})), view_of(right, camera_at({0.1, 0, 0}))});
  EXPECT_EQ(result.status, Status::kOutOfRange);
}

TEST(LineTriangulation, ThirdViewOrLyingElsewhereContradicts) {
  const LineView a = view_of(kUpright, camera_at({0, 0, 0}));
  const LineView b = view_of(kUpright, camera_at({0.3, 0, 0}));
  LineView c = view_of(kUpright, camera_at({0.15, 0.1, 0}));
  ASSERT_TRUE(triangulate_line({a, b, c}).ok());
  c.start.x() += 0.02;
  c.end.x() += 0.02;
  EXPECT_EQ(triangulate_line({a, b, c}).status, Status::kInconsistent);
  LineView beyond = b;  // on the same image line, but past its end
  beyond.start = b.start + 1.2 * (b.end - b.start);
  beyond.end = b.start + 2.0 * (b.end - b.start);
  EXPECT_EQ(triangulate_line({a, beyond}).status, Status::kInconsistent);
  LineView reversed = b;
  std::swap(reversed.start, reversed.end);
  EXPECT_EQ(triangulate_line({a, reversed}).status, Status::kInconsistent);
}

TEST(LineTriangulation, DegenerateInputIsRefused) {
  const LineView a = view_of(kUpright, camera_at({0, 0, 0}));
  LineView b = view_of(kUpright, camera_at({0.3, 0, 0}));
  EXPECT_EQ(triangulate_line({}).status, Status::kTooFewViews);
  EXPECT_EQ(triangulate_line({a}).status, Status::kTooFewViews);
  EXPECT_EQ(triangulate_line({a, a}).status, Status::kTooLittleParallax);
  LineView point = b;
  point.end = point.start;
  EXPECT_EQ(triangulate_line({a, point}).status, Status::kDegenerate);
  b.end.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(triangulate_line({a, b}).status, Status::kDegenerate);
}

}  // namespace
}  // namespace plumbline::geometry
