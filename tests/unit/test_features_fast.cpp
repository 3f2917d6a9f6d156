// SPDX-License-Identifier: BSD-3-Clause
// Our FAST kernel against OpenCV's.
#include <gtest/gtest.h>

#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include "fast.hpp"

namespace plumbline::features {
namespace {

cv::Mat noise(int width, int height, double blur, std::uint64_t seed = 3) {
  cv::Mat image(height, width, CV_8UC1);
  cv::RNG random(seed);
  random.fill(image, cv::RNG::UNIFORM, 0, 256);
  if (blur > 0.0) cv::GaussianBlur(image, image, {0, 0}, blur);
  return image;
}

void expect_same_corners(const cv::Mat& image, int threshold) {
  std::vector<cv::KeyPoint> expected;
  cv::FAST(image, expected, threshold, true);
  const std::vector<Corner> found = fast_corners(image, threshold);
  ASSERT_EQ(found.size(), expected.size()) << image.cols << " x " << image.rows << ", " << threshold;
  for (std::size_t i = 0; i < found.size(); ++i) {
    EXPECT_EQ(static_cast<float>(found[i].x), expected[i].pt.x);
    EXPECT_EQ(static_cast<float>(found[i].y), expected[i].pt.y);
    EXPECT_EQ(static_cast<float>(found[i].score), expected[i].response);
  }
}

TEST(Fast, FindsWhatOpenCvFinds) {
  for (const double blur : {0.0, 1.0, 2.0}) {
    for (const int threshold : {1, 7, 20, 60}) {
      for (const int width : {320, 101, 39, 38, 37, 20, 8, 7}) {
        expect_same_corners(noise(width, 60, blur), threshold);
      }
    }
  }
}

TEST(Fast, LooksOnlyAtItsPartOfAPicture) {
  const cv::Mat image = noise(200, 150, 1.0);
  for (const cv::Rect& part : {cv::Rect(17, 11, 150, 120), cv::Rect(100, 50, 25, 30), cv::Rect(0, 0, 6, 6)}) {
    expect_same_corners(image(part), 10);
  }
}

TEST(Fast, FlatAndSaturatedPicturesHaveNoCorners) {
  EXPECT_TRUE(fast_corners(cv::Mat(60, 80, CV_8UC1, cv::Scalar(0)), 1).empty());
  EXPECT_TRUE(fast_corners(cv::Mat(60, 80, CV_8UC1, cv::Scalar(255)), 1).empty());
  EXPECT_TRUE(fast_corners(cv::Mat(5, 5, CV_8UC1, cv::Scalar(255)), 1).empty());
}

TEST(Fast, BlackOnWhiteScoresAsMuchAsCan) {
  cv::Mat image(40, 60, CV_8UC1, cv::Scalar(255));
  image.at<std::uint8_t>(20, 30) = 0;
  const std::vector<Corner> found = fast_corners(image, 20);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].x, 30);
  EXPECT_EQ(found[0].y, 20);
  EXPECT_EQ(found[0].score, 254);
  expect_same_corners(image, 254);
}

}  // namespace
}  // namespace plumbline::features
