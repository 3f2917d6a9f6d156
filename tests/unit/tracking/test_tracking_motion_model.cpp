// SPDX-License-Identifier: BSD-3-Clause
// Where the next frame is looked for: by velocity, or by the recorder's own odometry.
#include <gtest/gtest.h>

#include "plumbline/tracking/tracker.hpp"

namespace plumbline::tracking {
namespace {

using geometry::Rigid3;

Rigid3 moved(double x, double turn = 0.0) {
  return {geometry::exp_so3({0.0, turn, 0.0}), Eigen::Vector3d(x, 0.0, 0.0)};
}

TrackResult tracked(const Rigid3& camera_from_world) {
  TrackResult result;
  result.state = TrackState::kTracked;
  result.camera_from_world = camera_from_world;
  return result;
}

double apart(const Rigid3& a, const Rigid3& b) {
  const Rigid3 step = a * b.inverse();
  return step.translation.norm() + geometry::rotation_angle(step.rotation);
}

TEST(MotionModel, OdometryTellsTheStepInAWorldOfItsOwn) {
  const Rigid3 map_from_odometry(geometry::exp_so3({0.3, -1.0, 0.2}), Eigen::Vector3d(4.0, -2.0, 1.0));
  const Rigid3 first = moved(0.1, 0.2);  // camera_from_world
  const Rigid3 second = moved(-0.5, -0.7);
  MotionModel motion;
  motion.set_odometry(map_from_odometry.inverse() * first.inverse());
  motion.update(0.0, tracked(first));
  motion.set_odometry(map_from_odometry.inverse() * second.inverse());
  EXPECT_TRUE(motion.knows_odometry());
  EXPECT_LT(apart(motion.predict(1.0), second), 1e-9) << "however long ago, and however fast";
  motion.set_odometry(std::nullopt);
  EXPECT_FALSE(motion.knows_odometry());
  EXPECT_LT(apart(motion.predict(1.0), first), 1e-9) << "no velocity is known yet";
}

TEST(MotionModel, FramesThatShowNothingAreBridgedByOdometry) {
  MotionModel by_odometry;
  MotionModel by_velocity;
  for (int i = 0; i < 3; ++i) {
    by_odometry.set_odometry(moved(0.1 * i).inverse());
    by_odometry.update(0.1 * i, tracked(moved(0.1 * i)));
    by_velocity.update(0.1 * i, tracked(moved(0.1 * i)));
  }
  for (int i = 3; i < 40; ++i) {
    by_odometry.set_odometry(moved(0.1 * i).inverse());
    by_odometry.lost();
    by_velocity.lost();
  }
  EXPECT_TRUE(by_velocity.outdated());
  EXPECT_TRUE(by_velocity.expired());
  EXPECT_FALSE(by_odometry.outdated());
  by_odometry.set_odometry(moved(4.0).inverse());
  EXPECT_LT(apart(by_odometry.predict(4.0), moved(4.0)), 1e-9);
}

}  // namespace
}  // namespace plumbline::tracking
