// SPDX-License-Identifier: BSD-3-Clause
// A camera stands still if neither it nor what it sees moves.
#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "../../../src/pipeline/robots/still_camera.hpp"

namespace plumbline::pipeline {
namespace {

class StillCameraTest : public testing::Test {
 protected:
  /// Frames until the camera counts as standing still; 100: it never does.
  template <typename Depth, typename Pose>
  int frames_until_still(const Depth& depth, const Pose& pose) {
    for (int i = 0; i < 100; ++i) {
      if (camera_.stands_still(pose(i), depth(i))) return i;
    }
    return 100;
  }
  static geometry::Rigid3 at(double x) {
    geometry::Rigid3 pose;
    pose.translation.x() = x;
    return pose;
  }
  cv::Mat noisy(double z) {
    cv::Mat depth(120, 160, CV_32FC1);
    random_.fill(depth, cv::RNG::NORMAL, z, 0.003);
    return depth;
  }

  StillCamera camera_;
  cv::RNG random_{7};
};

TEST_F(StillCameraTest, NoiseIsNoMotion) {
  EXPECT_EQ(frames_until_still([&](int) { return noisy(2.0); }, [&](int i) { return at(i % 2 * 0.002); }),
            30);
  EXPECT_TRUE(camera_.stands_still(at(0.0), noisy(2.0)));
  camera_.lose();
  EXPECT_FALSE(camera_.stands_still(at(0.0), noisy(2.0)));
}

TEST_F(StillCameraTest, SlowMotionIsMotion) {
  EXPECT_EQ(frames_until_still([&](int) { return noisy(2.0); }, [&](int i) { return at(i * 0.001); }), 100);
}

TEST_F(StillCameraTest, SomethingThatComesOrGoesIsSeen) {
  const auto walks_through = [&](int i) {
    cv::Mat depth = noisy(3.0);
    depth(cv::Rect(i / 10 * 15, 30, 20, 60)) = 1.5;
    return depth;
  };
  EXPECT_EQ(frames_until_still(walks_through, [&](int) { return at(0.0); }), 100);
}

}  // namespace
}  // namespace plumbline::pipeline
