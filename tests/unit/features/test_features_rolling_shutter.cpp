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

/// Where a shutter that takes kReadout finds a point, which lies at `still` when the middle row is read.
Eigen::Vector3d sheared(const Eigen::Vector3d& still, const geometry::Vector6d& velocity) {
  Eigen::Vector3d found = still;
  for (int i = 0; i < 20; ++i) {  // the row tells the time, the time the row
    const double seconds = (kRollingCamera.project(found).y() / kRollingCamera.height - 0.5) * kReadout;
    found = geometry::exp_se3(seconds * velocity) * still;
  }
  return found;
}

geometry::Vector6d velocity(const Eigen::Vector3d& metres, const Eigen::Vector3d& turn) {
  return (geometry::Vector6d() << metres, turn).finished();
}

TEST(RollingShutter, PointsAndLinesComeBackToWhereAPictureTakenAtOnceShowsThem) {
  const geometry::Vector6d motion = velocity({0.4, -0.7, 0.6}, {1.1, -0.8, 1.3});
  std::mt19937 random(7);
  std::uniform_real_distribution<double> x(30.0, 610.0);
  std::uniform_real_distribution<double> y(30.0, 450.0);
  FrameFeatures features;
  std::vector<Eigen::Vector3d> expected;
  double farthest = 0.0;
  for (int i = 0; i < 50; ++i) {
    expected.push_back(kRollingCamera.unproject(x(random), y(random), 1.0 + 0.05 * i));
    const Eigen::Vector3d found = sheared(expected.back(), motion);
    PointFeature point;
    point.pixel = kRollingCamera.project(found).cast<float>();
    point.depth = static_cast<float>(found.z());
    farthest =
        std::max(farthest, (kRollingCamera.project(found) - kRollingCamera.project(expected.back())).norm());
    features.points.push_back(point);
  }
  ASSERT_GT(farthest, 8.0);
  LineFeature line;
  const Eigen::Vector3d ends[2] = {kRollingCamera.unproject(100.0, 60.0, 2.0),
                                   kRollingCamera.unproject(400.0, 430.0, 3.0)};
  line.line3.emplace();
  line.line3->start = sheared(ends[0], motion);
  line.line3->end = sheared(ends[1], motion);
  line.segment.start = kRollingCamera.project(line.line3->start).cast<float>();
  line.segment.end = kRollingCamera.project(line.line3->end).cast<float>();
  features.lines.push_back(line);

  undo_rolling_shutter(features, kRollingCamera, motion, kReadout);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const Eigen::Vector2d pixel = kRollingCamera.project(expected[i]);
    EXPECT_LT((features.points[i].pixel.cast<double>() - pixel).norm(), 0.01);
    EXPECT_NEAR(features.points[i].depth, expected[i].z(), 1e-4);
    std::vector<int> near;
    features.grid.within(features.points, static_cast<float>(pixel.x()), static_cast<float>(pixel.y()), 1.0F,
                         near);
    EXPECT_NE(std::find(near.begin(), near.end(), static_cast<int>(i)), near.end());
  }
  const LineFeature& moved = features.lines.front();
  EXPECT_LT((moved.segment.start.cast<double>() - kRollingCamera.project(ends[0])).norm(), 0.01);
  EXPECT_LT((moved.segment.end.cast<double>() - kRollingCamera.project(ends[1])).norm(), 0.01);
  EXPECT_LT((moved.line3->start - ends[0]).norm(), 1e-4);
  EXPECT_LT((moved.line3->end - ends[1]).norm(), 1e-4);
}

TEST(RollingShutter, WhatHasNoDepthIsTurnedOnly) {
  FrameFeatures features;
  PointFeature point;
  point.pixel = {100.25F, 20.5F};
  features.points.push_back(point);
  undo_rolling_shutter(features, kRollingCamera, velocity({1.0, 1.0, 1.0}, {0.0, 0.0, 0.0}), kReadout);
  EXPECT_LT((features.points[0].pixel - point.pixel).norm(), 1e-4F);
  undo_rolling_shutter(features, kRollingCamera, velocity({0.0, 0.0, 0.0}, {1.0, 1.0, 1.0}), kReadout);
  EXPECT_GT((features.points[0].pixel - point.pixel).norm(), 4.0F);
  EXPECT_EQ(features.points[0].depth, 0.0F);
}

TEST(RollingShutter, NothingIsMovedBehindTheCamera) {
  FrameFeatures features;
  PointFeature point;
  point.pixel = {100.25F, 470.5F};
  point.depth = 0.2F;
  features.points.push_back(point);
  undo_rolling_shutter(features, kRollingCamera, velocity({0.0, 0.0, 20.0}, {0.0, 0.0, 0.0}), kReadout);
  EXPECT_LT((features.points[0].pixel - point.pixel).norm(), 1e-3F);
  EXPECT_NEAR(features.points[0].depth, 0.2F, 1e-6F);
}

TEST(RollingShutter, NothingMovesWithoutMotionOrReadout) {
  FrameFeatures features;
  PointFeature point;
  point.pixel = {100.25F, 20.5F};
  features.points.push_back(point);
  undo_rolling_shutter(features, kRollingCamera, geometry::Vector6d::Zero(), kReadout);
  EXPECT_EQ(features.points[0].pixel, point.pixel);
  undo_rolling_shutter(features, kRollingCamera, velocity({1.0, 1.0, 1.0}, {1.0, 1.0, 1.0}), 0.0);
  EXPECT_EQ(features.points[0].pixel, point.pixel);
}

}  // namespace
}  // namespace plumbline::features
