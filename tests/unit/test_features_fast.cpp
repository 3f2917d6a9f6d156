// SPDX-License-Identifier: BSD-3-Clause
// Our FAST and ORB kernels against OpenCV's.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include "fast.hpp"
#include "orb_describe.hpp"

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

TEST(OrbDescriptor, HasTheBitsOfOpenCv) {
  const cv::Mat image = noise(320, 240, 1.5);
  std::vector<cv::KeyPoint> points;
  for (int y = kOrbMargin; y < image.rows - kOrbMargin; y += 9) {
    for (int x = kOrbMargin; x < image.cols - kOrbMargin; x += 7) {
      points.emplace_back(static_cast<float>(x), static_cast<float>(y), 31.0F, orb_orientation(image, x, y),
                          1.0F, 0);
    }
  }
  ASSERT_GT(points.size(), 500U);
  const std::size_t asked = points.size();
  cv::Mat expected;
  cv::ORB::create(static_cast<int>(asked), 1.2F, 1, 16, 0, 2, cv::ORB::HARRIS_SCORE, 31, 20)
      ->compute(image, points, expected);
  ASSERT_EQ(points.size(), asked);
  const cv::Mat smooth = orb_smooth(image);
  int different = 0;
  for (std::size_t i = 0; i < asked; ++i) {
    Descriptor256 theirs;
    std::memcpy(theirs.data(), expected.ptr(static_cast<int>(i)), sizeof theirs);
    const cv::KeyPoint& p = points[i];
    different += hamming_distance(theirs, orb_descriptor(smooth, cvRound(p.pt.x), cvRound(p.pt.y), p.angle));
  }
  EXPECT_EQ(different, 0);
}

// The weight of a ramp grows in its own direction.
TEST(OrbDescriptor, OrientationPointsTowardsTheLight) {
  for (double degrees = 0.0; degrees < 360.0; degrees += 15.0) {
    cv::Mat image(64, 64, CV_8UC1);
    const double cosine = std::cos(degrees * CV_PI / 180.0);
    const double sine = std::sin(degrees * CV_PI / 180.0);
    for (int y = 0; y < 64; ++y) {
      for (int x = 0; x < 64; ++x) {
        image.at<std::uint8_t>(y, x) =
            cv::saturate_cast<std::uint8_t>(128.0 + 3.0 * ((x - 32) * cosine + (y - 32) * sine));
      }
    }
    const double found = orb_orientation(image, 32, 32);
    EXPECT_NEAR(std::remainder(found - degrees, 360.0), 0.0, 1.5) << degrees;
  }
}

}  // namespace
}  // namespace plumbline::features
