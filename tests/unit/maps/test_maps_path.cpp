// SPDX-License-Identifier: BSD-3-Clause
// The path from frame to frame beside what the tracker saw.
#include <gtest/gtest.h>

#include <memory>

#include "plumbline/maps/frame_pose.hpp"
#include "plumbline/maps/map.hpp"
#include "random_world.hpp"

namespace plumbline::maps {
namespace {

using geometry::Rigid3;

/// Three keyframes of robots 0 and 1, four frames on each, tracked as they lie.
struct Path {
  Map map;
  std::vector<FramePose> frames;
  explicit Path(double sigma_m = 0.002) {
    for (std::int32_t robot = 0; robot < 2; ++robot) {
      Rigid3 last;
      for (int f = 0; f < 12; ++f) {
        const Rigid3 pose(geometry::exp_so3({0.0, 0.02 * f, 0.0}), {0.05 * f, 0.0, 0.0});
        if (f % 4 == 0) {
          auto keyframe = std::make_shared<Keyframe>();
          keyframe->id = {robot, f / 4};
          map.add_keyframe(keyframe, pose);
        }
        FramePose frame;
        frame.stamp = f / 30.0;
        frame.reference = {robot, f / 4};
        frame.camera_from_reference = pose * map.camera_from_world(frame.reference).inverse();
        frame.tracked = true;
        if (f > 0) frame.camera_from_previous = pose * last.inverse();
        frame.step_sigma_m = sigma_m;
        last = pose;
        frames.push_back(frame);
      }
    }
  }
  void move(KeyframeId id, const Rigid3& by) { map.set_pose(id, by * map.camera_from_world(id)); }
};

TEST(Path, AsItWasTrackedIsWhole) {
  const PathCheck check = check_path(Path().frames, Path().map);
  EXPECT_TRUE(check.tears.empty());
  EXPECT_LT(check.largest_m, 1e-12);
}

TEST(Path, AJumpIsToldWithItsTimeAndKeyframes) {
  Path path;
  path.move({1, 2}, Rigid3(Eigen::Matrix3d::Identity(), {0.0, 0.1, 0.0}));
  const PathCheck check = check_path(path.frames, path.map);
  ASSERT_EQ(check.tears.size(), 1U);
  EXPECT_EQ(check.tears[0].from, (KeyframeId{1, 1}));
  EXPECT_EQ(check.tears[0].to, (KeyframeId{1, 2}));
  EXPECT_DOUBLE_EQ(check.tears[0].stamp, 8 / 30.0);
  EXPECT_NEAR(check.tears[0].off_m, 0.1, 1e-9);
}

TEST(Path, NoiseIsNoTear) {
  Path path;
  path.move({0, 1}, Rigid3(Eigen::Matrix3d::Identity(), {0.0, 0.02, 0.0}));
  const PathCheck check = check_path(path.frames, path.map);
  EXPECT_TRUE(check.tears.empty());
  EXPECT_NEAR(check.largest_m, 0.02, 1e-9);
  Path turned;
  turned.move({0, 1}, Rigid3(geometry::exp_so3({0.0, 0.0, 0.06}), {0.0, 0.0, 0.0}));
  EXPECT_EQ(check_path(turned.frames, turned.map).tears.size(), 2U) << "in front of it and behind";
  Path corridor(0.1);
  corridor.move({0, 1}, Rigid3(Eigen::Matrix3d::Identity(), {0.2, 0.0, 0.0}));
  EXPECT_TRUE(check_path(corridor.frames, corridor.map).tears.empty())
      << "the tracker did not know it better";
}

TEST(Path, WhereTrackingWasLostNothingIsKnown) {
  Path path;
  path.move({0, 1}, Rigid3(Eigen::Matrix3d::Identity(), {0.0, 0.5, 0.0}));
  path.frames[3].tracked = false;
  path.frames[8].camera_from_previous.reset();
  EXPECT_TRUE(check_path(path.frames, path.map).tears.empty());
  EXPECT_TRUE(check_path({}, path.map).tears.empty());
}

}  // namespace
}  // namespace plumbline::maps
