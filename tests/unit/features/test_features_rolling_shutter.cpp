// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "plumbline/features/rolling_shutter.hpp"
#include "plumbline/geometry/rigid3.hpp"

namespace plumbline::features {
namespace {

const sensor::Pinhole kRollingCamera{640, 480, 525.0, 520.0, 319.5, 239.5};
constexpr double kReadout = 0.03;

/// Where a shutter that takes kReadout shows a point, which a camera at rest would show at `still`.
Eigen::Vector2d sheared(const Eigen::Vector2d& still, const Eigen::Vector3d& turn_rate) {
  Eigen::Vector2d seen = still;
  for (int i = 0; i < 20; ++i) {  // the row tells the time, the time the row
    const double seconds = (seen.y() / kRollingCamera.height - 0.5) * kReadout;
    seen = kRollingCamera.project(geometry::exp_so3(seconds * turn_rate) *
                                  kRollingCamera.unproject(still.x(), still.y(), 1.0));
  }
  return seen;
}

TEST(RollingShutter, PointsAndLinesComeBackToWhereAPictureTakenAtOnceShowsThem) {
  const Eigen::Vector3d turn_rate(1.1, -0.8, 1.3);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> x(30.0, 610.0);
  std::uniform_real_distribution<double> y(30.0, 450.0);
  FrameFeatures features;
  std::vector<Eigen::Vector2d> expected;
  double farthest = 0.0;
  for (int i = 0; i < 50; ++i) {
    expected.emplace_back(x(random), y(random));
    PointFeature point;
    point.pixel = sheared(expected.back(), turn_rate).cast<float>();
    farthest = std::max(farthest, (point.pixel.cast<double>() - expected.back()).norm());
    features.points.push_back(point);
  }
  ASSERT_GT(farthest, 8.0);
  LineFeature line;
  const Eigen::Vector2d ends[2] = {{100.0, 60.0}, {400.0, 430.0}};
  line.segment.start = sheared(ends[0], turn_rate).cast<float>();
  line.segment.end = sheared(ends[1], turn_rate).cast<float>();
  line.line3.emplace();
  line.line3->start = 2.0 * kRollingCamera.unproject(static_cast<double>(line.segment.start.x()),
                                                     static_cast<double>(line.segment.start.y()), 1.0);
  line.line3->end = 3.0 * kRollingCamera.unproject(static_cast<double>(line.segment.end.x()),
                                                   static_cast<double>(line.segment.end.y()), 1.0);
  const double distance = line.line3->start.norm();
  features.lines.push_back(line);

  undo_rolling_shutter(features, kRollingCamera, turn_rate, kReadout);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_LT((features.points[i].pixel.cast<double>() - expected[i]).norm(), 0.01);
    std::vector<int> near;
    features.grid.within(features.points, static_cast<float>(expected[i].x()),
                         static_cast<float>(expected[i].y()), 1.0F, near);
    EXPECT_NE(std::find(near.begin(), near.end(), static_cast<int>(i)), near.end());
  }
  const LineFeature& moved = features.lines.front();
  EXPECT_LT((moved.segment.start.cast<double>() - ends[0]).norm(), 0.01);
  EXPECT_LT((moved.segment.end.cast<double>() - ends[1]).norm(), 0.01);
  // The 3D line's image is the segment, still.
  EXPECT_LT((kRollingCamera.project(moved.line3->start) - ends[0]).norm(), 0.01);
  EXPECT_LT((kRollingCamera.project(moved.line3->end) - ends[1]).norm(), 0.01);
  EXPECT_NEAR(moved.line3->start.norm(), distance, 1e-9);
}

TEST(RollingShutter, NothingMovesWithoutTurnOrReadout) {
  FrameFeatures features;
  PointFeature point;
  point.pixel = {100.25F, 20.5F};
  features.points.push_back(point);
  undo_rolling_shutter(features, kRollingCamera, Eigen::Vector3d::Zero(), kReadout);
  EXPECT_EQ(features.points[0].pixel, point.pixel);
  undo_rolling_shutter(features, kRollingCamera, {1.0, 1.0, 1.0}, 0.0);
  EXPECT_EQ(features.points[0].pixel, point.pixel);
  undo_rolling_shutter(features, kRollingCamera, {1.0, 1.0, 1.0}, kReadout);
  EXPECT_NE(features.points[0].pixel, point.pixel);
}

}  // namespace
}  // namespace plumbline::features
