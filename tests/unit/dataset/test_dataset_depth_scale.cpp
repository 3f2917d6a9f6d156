// SPDX-License-Identifier: BSD-3-Clause
// Does the depth of a recording look as if it were read in the wrong unit?
#include <gmock/gmock.h>

#include <string>
#include <vector>

#include "test_dataset_world.hpp"

namespace plumbline::dataset {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class DepthScale : public RecordingTest {
 protected:
  void write(int raw_depth, const std::string& scale) {
    write_tum(3, raw_depth);
    write_camera("depth_scale: " + scale + "\n");
  }
};

TEST_F(DepthScale, ErrorNamesTheScaleThatFits) {
  write(1900, "50000");
  EXPECT_THAT(open_error(), AllOf(HasSubstr("0.038 m"), HasSubstr("depth_scale 1000 would fit")));
  write(9500, "1");
  EXPECT_THAT(open_error(), HasSubstr("depth_scale 5000 would fit"));
  write(14000, "1");
  EXPECT_THAT(open_error(), HasSubstr("depth_scale 5000 would fit"));
  write(300, "5000");
  EXPECT_THAT(open_error(), HasSubstr("depth_scale 100 would fit"));
  write(2, "5000");
  EXPECT_THAT(open_error(), HasSubstr("depth_scale 1 would fit"));
}

TEST_F(DepthScale, OneSignWarnsAndNamesTheScaleThatFits) {
  write(12500, "1000");
  const auto far = open();
  ASSERT_TRUE(far);
  EXPECT_EQ((*far)->doubt(), "");
  EXPECT_THAT(log_.warnings, AllOf(HasSubstr("12.5 m"), HasSubstr("beyond the 10 m"),
                                   HasSubstr("depth_scale 5000 would fit")));
  log_.warnings.clear();
  write(500, "5000");
  ASSERT_TRUE(open());
  EXPECT_THAT(log_.warnings, AllOf(HasSubstr("0.1 m"), HasSubstr("nearer than the 0.2 m")));
}

/// A right scan of something close, or of a hall, has an unusual median and nothing else.
TEST_F(DepthScale, AMedianAloneIsNoSign) {
  for (const int raw : {2000, 2500, 45000}) {
    write(raw, "5000");
    ASSERT_TRUE(open());
    EXPECT_EQ(log_.warnings, "") << raw;
  }
  write(1000, "10000");  // 0.1 m, in the unit of cameras for close work
  ASSERT_TRUE(open());
  EXPECT_EQ(log_.warnings, "");
}

/// A Kinect's steps of an eighth of a pixel, ten times as large: its scale is a tenth of what is right.
TEST_F(DepthScale, StepsOfDisparityAreASecondSign) {
  const auto slope = [&](const std::string& scale) {
    write(5000, scale);
    for (int i = 0; i < 3; ++i) {
      cv::Mat raw(48, 64, CV_16UC1);
      for (int k = 0; k < 48 * 64; ++k)
        raw.at<std::uint16_t>(k / 64, k % 64) =
            static_cast<std::uint16_t>(std::lround(5000.0 / (0.12 + 0.0028 * (k % 390))));
      cv::imwrite((folder_ / "depth" / (std::to_string(i) + ".png")).string(), raw);
    }
  };
  slope("5000");
  const auto right = open();
  ASSERT_TRUE(right);
  EXPECT_EQ(log_.warnings, "");
  slope("500");
  const auto wrong = open();
  ASSERT_TRUE(wrong);
  EXPECT_THAT((*wrong)->doubt(), AllOf(HasSubstr("beyond the 10 m"), HasSubstr("no camera's disparity")));
}

TEST_F(DepthScale, BackgroundBeyondEveryDepthCamerasReachIsDoubted) {
  // A desk at 1.3 m before a wall at 2.5 m, in TUM's unit read as millimetres: the median is that of a room.
  const auto desk_before_wall = [&](const std::string& scale) {
    write(6500, scale);
    for (int i = 0; i < 3; ++i) {
      const std::string file = (folder_ / "depth" / (std::to_string(i) + ".png")).string();
      cv::Mat raw = cv::imread(file, cv::IMREAD_UNCHANGED);
      raw.colRange(0, raw.cols / 4).setTo(12500);
      cv::imwrite(file, raw);
    }
  };
  desk_before_wall("1000");
  EXPECT_TRUE(open());
  EXPECT_THAT(log_.warnings, AllOf(HasSubstr("6.5 m"), HasSubstr("depth_scale 5000 would fit")));
  log_.warnings.clear();
  desk_before_wall("5000");
  EXPECT_TRUE(open());
  EXPECT_EQ(log_.warnings, "");
}

TEST_F(DepthScale, UsualDepthIsSilent) {
  write(9500, "5000");
  EXPECT_TRUE(open());
  EXPECT_EQ(log_.warnings, "");
}

}  // namespace
}  // namespace plumbline::dataset
