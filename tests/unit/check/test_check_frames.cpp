// SPDX-License-Identifier: BSD-3-Clause
// Which frames are kept for the check, and what is left of them.
#include <gtest/gtest.h>

#include <filesystem>
#include <opencv2/core.hpp>
#include <random>

#include "plumbline/check/frame_store.hpp"
#include "plumbline/check/recalibrated_frame.hpp"

namespace plumbline::check {
namespace {

using Use = FrameChoice::Use;

TEST(CheckFrames, AnchorsAreAThirdOfASecondApart) {
  FrameChoice choice;
  std::vector<int> anchors, next;
  for (int i = 0; i < 90; ++i) {
    const Use use = choice.next(100.0 + i / 30.0);
    if (use == Use::kAnchor) anchors.push_back(i);
    if (use == Use::kNext) next.push_back(i);
  }
  EXPECT_EQ(anchors, (std::vector<int>{0, 10, 20, 30, 40, 50, 60, 70, 80}));
  EXPECT_EQ(next, (std::vector<int>{1, 31, 61}));

  // A slow camera's frames are all anchors; after a gap the next frame is one.
  FrameChoice slow;
  for (const double stamp : {0.0, 0.5, 1.0, 4.0, 4.5}) EXPECT_EQ(slow.next(stamp), Use::kAnchor) << stamp;
}

TEST(CheckFrames, StoreGivesBackWhatWasShrunk) {
  const sensor::Pinhole camera{640, 480, 525.0, 525.0, 319.5, 239.5};
  sensor::RgbdFrame frame;
  frame.stamp = 1.5;
  frame.depth_stamp = 1.51;
  frame.gray.create(480, 640, CV_8UC1);
  frame.depth.create(480, 640, CV_32FC1);
  std::mt19937 random(7);
  for (int v = 0; v < 480; ++v) {
    for (int u = 0; u < 640; ++u) {
      frame.gray.at<std::uint8_t>(v, u) = static_cast<std::uint8_t>(random() % 200);
      frame.depth.at<float>(v, u) = u < 10   ? 0.0F
                                    : u < 20 ? 17.0F
                                             : 0.5F + 0.01F * static_cast<float>(random() % 900);
    }
  }

  const SmallFrame small = shrink(frame, camera);
  ASSERT_EQ(small.gray.size(), cv::Size(320, 240));
  EXPECT_EQ(small.depth.at<std::uint16_t>(5, 3), 0);  // none
  EXPECT_EQ(small.depth.at<std::uint16_t>(5, 8), 0);  // too far
  const float exact = frame.depth.at<float>(grid_pixel(100, 480, 240), grid_pixel(200, 640, 320));
  EXPECT_NEAR(small.depth.at<std::uint16_t>(100, 200) / kDepthUnits_per_m, exact, 0.51 / kDepthUnits_per_m);

  FrameStore store(std::filesystem::temp_directory_path());
  ASSERT_EQ(store.add(small), 0U);
  SmallFrame other = small.gray.empty() ? small : shrink(frame, camera);
  other.gray = 255 - small.gray;
  other.stamp = 9.0;
  ASSERT_EQ(store.add(other), 1U);
  for (const auto& [number, kept] : {std::pair{0U, &small}, {1U, &other}}) {
    const auto read = store.read(number);
    ASSERT_TRUE(read);
    EXPECT_EQ(read->stamp, kept->stamp);
    EXPECT_EQ(read->depth_stamp, 1.51);
    EXPECT_EQ(cv::countNonZero(read->gray != kept->gray), 0);
    EXPECT_EQ(cv::countNonZero(read->depth != kept->depth), 0);
  }
}

TEST(CheckFrames, AnotherCameraMovesPicturesAndTiltsDepth) {
  sensor::Camera before;
  before.color = {320, 240, 260.0, 260.0, 159.5, 119.5};
  sensor::Camera after = before;
  after.color.cx += 4.0;  // rectified into the same pinhole, all moves 4 px to the left
  after.depth_slope = {0.02, 0.0};
  after.depth_delay_s = 0.01;

  SmallFrame frame;
  frame.gray = cv::Mat(240, 320, CV_8UC1, cv::Scalar(10));
  frame.gray.colRange(200, 320) = 200;
  frame.depth = cv::Mat(240, 320, CV_16UC1, cv::Scalar(2.0 * kDepthUnits_per_m));
  const SmallFrame changed = RecalibratedFrame(before.color, before, after)(frame);
  EXPECT_EQ(changed.gray.at<std::uint8_t>(120, 197), 200);
  EXPECT_EQ(changed.gray.at<std::uint8_t>(120, 194), 10);
  EXPECT_NEAR(changed.depth_stamp, 0.01, 1e-12);
  const double x = (250.0 - 159.5) / 260.0;
  EXPECT_NEAR(kDepthUnits_per_m / changed.depth.at<std::uint16_t>(120, 250), 0.5 + 0.02 * x, 2e-4);
}

}  // namespace
}  // namespace plumbline::check
