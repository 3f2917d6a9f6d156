// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "plumbline/geometry/trajectory.hpp"

namespace plumbline::geometry {
namespace {

// One metre along x each second.
StampedPose at(double stamp) { return {stamp, {Eigen::Matrix3d::Identity(), {stamp, 0.0, 0.0}}}; }

double x_at(const Trajectory& trajectory, double stamp, double max_gap_s = 0.02) {
  const auto pose = pose_at(trajectory, stamp, max_gap_s);
  return pose ? pose->translation.x() : -1000.0;
}

TEST(PoseAt, InterpolatesAndHitsTheStampsThemselves) {
  const Trajectory t{at(1.0), at(1.03), at(1.05)};
  EXPECT_NEAR(x_at(t, 1.01), 1.01, 1e-12);
  EXPECT_NEAR(x_at(t, 1.045), 1.045, 1e-12);
  EXPECT_DOUBLE_EQ(x_at(t, 1.0), 1.0);
  EXPECT_DOUBLE_EQ(x_at(t, 1.03), 1.03);
  EXPECT_DOUBLE_EQ(x_at(t, 1.05), 1.05);
}

TEST(PoseAt, HasNothingOutside) {
  const Trajectory t{at(1.0), at(1.03)};
  EXPECT_FALSE(pose_at(t, 0.99));
  EXPECT_FALSE(pose_at(t, 1.04));
  EXPECT_FALSE(pose_at({}, 1.0));
  EXPECT_FALSE(pose_at({at(1.0)}, 1.01));
  EXPECT_TRUE(pose_at({at(1.0)}, 1.0));
}

TEST(PoseAt, StampsThatDifferByRoundingAreTheSame) {
  const Trajectory t{at(1305031098.6659), at(1305031098.6959)};
  for (const StampedPose& pose : t) {
    EXPECT_TRUE(pose_at(t, pose.stamp - 3e-7));
    EXPECT_TRUE(pose_at(t, pose.stamp + 3e-7));
  }
}

TEST(PoseAt, LongGapsAreBridgedNearTheirEndsOnly) {
  const Trajectory t{at(1.0), at(2.0)};
  EXPECT_NEAR(x_at(t, 1.015), 1.015, 1e-12);
  EXPECT_NEAR(x_at(t, 1.99), 1.99, 1e-12);
  EXPECT_FALSE(pose_at(t, 1.03));
  EXPECT_FALSE(pose_at(t, 1.5));
  EXPECT_NEAR(x_at(t, 1.5, 0.6), 1.5, 1e-12);  // not a long gap any more
}

}  // namespace
}  // namespace plumbline::geometry
