// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <random>

#include "depth_roughness.hpp"
#include "plumbline/features/frame_features.hpp"
#include "plumbline/sensor/depth_noise.hpp"

namespace plumbline::features {
namespace {

const sensor::Pinhole kCamera{640, 480, 525.0, 525.0, 319.5, 239.5};

TEST(PointGrid, FindsWhatABruteForceSearchFinds) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> x(0.0F, 639.0F);
  std::uniform_real_distribution<float> y(0.0F, 479.0F);
  std::vector<PointFeature> points(500);
  for (auto& p : points) p.pixel = {x(random), y(random)};
  points[0].pixel = {0.0F, 0.0F};
  points[1].pixel = {639.0F, 479.0F};
  const PointGrid grid(points, 640, 480);
  for (int i = 0; i < 300; ++i) {
    const float u = 1.2F * x(random) - 60.0F;  // also from outside
    const float v = 1.2F * y(random) - 50.0F;
    const float radius = static_cast<float>(i % 80);
    std::vector<int> found;
    grid.within(points, u, v, radius, found);
    std::sort(found.begin(), found.end());
    std::vector<int> expected;
    for (int k = 0; k < 500; ++k) {
      if ((points[static_cast<std::size_t>(k)].pixel - Eigen::Vector2f(u, v)).squaredNorm() <=
          radius * radius) {
        expected.push_back(k);
      }
    }
    ASSERT_EQ(found, expected);
  }
}

TEST(PointGrid, EmptyOnesFindNothing) {
  std::vector<int> found;
  PointGrid().within({}, 10, 10, 100, found);
  PointGrid({}, 640, 480).within({}, 10, 10, 100, found);
  EXPECT_TRUE(found.empty());
}

TEST(CornerDepth, IsThatOfOneSurfaceOnly) {
  cv::Mat depth(100, 100, CV_32FC1, cv::Scalar(2.0F));
  EXPECT_FLOAT_EQ(corner_depth(depth, 50.0F, 50.0F).z, 2.0F);
  EXPECT_FLOAT_EQ(corner_depth(depth, 0.0F, 0.0F).z, 2.0F)
      << "the corner of the picture still has nine pixels";
  depth.at<float>(50, 50) = 0.0F;
  EXPECT_FLOAT_EQ(corner_depth(depth, 50.0F, 50.0F).z, 2.0F) << "a hole in the middle is bridged";
  depth(cv::Rect(52, 0, 48, 100)).setTo(3.0F);
  EXPECT_EQ(corner_depth(depth, 50.0F, 50.0F).z, 0.0F) << "over a border";
  EXPECT_FLOAT_EQ(corner_depth(depth, 49.0F, 50.0F).z, 2.0F) << "just beside it";
}

TEST(CornerDepth, SlantedSurfacesAreReadBetweenPixels) {
  cv::Mat depth(100, 100, CV_32FC1);
  const auto z = [](float u, float v) { return 1.0F / (0.4F - 0.0012F * u + 0.0009F * v); };
  for (int v = 0; v < 100; ++v) {
    for (int u = 0; u < 100; ++u) depth.at<float>(v, u) = z(static_cast<float>(u), static_cast<float>(v));
  }
  depth.at<float>(51, 48) = 0.0F;
  const CornerDepth found = corner_depth(depth, 49.6F, 50.3F);
  EXPECT_NEAR(found.z, z(49.6F, 50.3F), 1e-5F);
  FrameFeatures features;
  features.points.resize(1);
  features.points[0].pixel = {49.6F, 50.3F};
  features.points[0].depth = found.z;
  features.patches.resize(1);
  EXPECT_EQ(features.depth_beside(0, {3.0F, -2.0F}), found.z) << "no slant is known";
  features.slants = {found.slant};
  EXPECT_NEAR(features.depth_beside(0, {3.0F, -2.0F}), z(52.6F, 48.3F), 1e-4F);
  EXPECT_EQ(features.depth_beside(0, {400.0F, 0.0F}), 0.0F) << "beyond the horizon of the surface";
  features.move_point(0, {-2.0F, 1.5F});
  EXPECT_NEAR(features.points[0].depth, z(47.6F, 51.8F), 1e-4F) << "moved corners take their depth along";
}

/// Depth of a wall at 2.2 m, slanted, with the noise of a sensor; right of column 50 it is nearer by
/// `step_m`.
cv::Mat noisy_wall(float step_m, double noise) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal(0.0, noise);
  cv::Mat depth(100, 100, CV_32FC1);
  for (int v = 0; v < 100; ++v) {
    for (int u = 0; u < 100; ++u) {
      const double z = 1.0 / (0.45 - 0.0008 * u) - (u > 50 ? static_cast<double>(step_m) : 0.0);
      depth.at<float>(v, u) = static_cast<float>(z + normal(random) * sensor::depth_sigma(z));
    }
  }
  return depth;
}

TEST(DepthRoughness, TellsLowBordersFromNoiseOfAnySize) {
  for (const double noise : {0.1, 0.5, 1.0}) {
    const auto roughness_at = [&](const cv::Mat& depth, int u) {
      return depth_roughness(depth, u, 40, 5, 1);
    };
    const cv::Mat plain = noisy_wall(0.0F, noise);
    std::vector<float> most;
    for (int u = 10; u < 90; ++u) most.push_back(roughness_at(plain, u));
    const float limit = roughness_limit(most);
    EXPECT_LT(*std::max_element(most.begin(), most.end()), limit) << "noise " << noise;
    const cv::Mat stepped = noisy_wall(0.07F, noise);
    for (int u = 47; u < 55; ++u) EXPECT_GT(roughness_at(stepped, u), limit) << u << ", noise " << noise;
    EXPECT_LT(roughness_at(stepped, 42), limit) << "well beside it";
  }
  EXPECT_NEAR(roughness_limit({}), 2.0F, 1e-6F) << "the sensor's model, where nothing was seen";
  EXPECT_GT(depth_roughness(cv::Mat(20, 20, CV_32FC1, cv::Scalar(0.0)), 10, 10, 5, 1), 100.0F);
  EXPECT_GT(depth_roughness(cv::Mat(20, 20, CV_32FC1, cv::Scalar(2.0)), 0, 0, 5, 1), 100.0F)
      << "in the picture's corner nothing lies opposite";
}

TEST(CornerDepth, BadDepthIsNoDepth) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  EXPECT_EQ(corner_depth({}, 5.0F, 5.0F).z, 0.0F);
  for (float bad : {0.0F, -1.0F, nan, infinity}) {
    cv::Mat depth(20, 20, CV_32FC1, cv::Scalar(static_cast<double>(bad)));
    EXPECT_EQ(corner_depth(depth, 10.0F, 10.0F).z, 0.0F) << bad;
  }
  cv::Mat depth(20, 20, CV_32FC1, cv::Scalar(static_cast<double>(nan)));
  depth(cv::Rect(8, 8, 3, 2)).setTo(1.5F);
  EXPECT_EQ(corner_depth(depth, 10.0F, 10.0F).z, 0.0F) << "too few";
}

sensor::RgbdFrame textured_frame() {
  sensor::RgbdFrame frame;
  frame.gray = cv::Mat(480, 640, CV_8UC1);
  cv::RNG random(4);
  random.fill(frame.gray, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(frame.gray, frame.gray, {9, 9}, 2.0);
  cv::normalize(frame.gray, frame.gray, 0, 255, cv::NORM_MINMAX);
  frame.depth = cv::Mat(480, 640, CV_32FC1, cv::Scalar(2.0F));
  frame.depth(cv::Rect(320, 0, 320, 480)).setTo(3.0F);
  return frame;
}

TEST(FeatureExtractor, PointsCarryDepthExceptOverBorders) {
  const FrameFeatures found = FeatureExtractor({}, kCamera).extract(textured_frame());
  ASSERT_GT(found.points.size(), 700U);
  ASSERT_EQ(found.points.size(), found.descriptors.size());
  int at_border = 0;
  for (const PointFeature& p : found.points) {
    if (p.pixel.x() < 317.0F || p.pixel.x() > 322.5F) {
      EXPECT_FLOAT_EQ(p.depth, p.pixel.x() < 320.0F ? 2.0F : 3.0F);
    }
    if (p.pixel.x() > 318.6F && p.pixel.x() < 320.4F) {
      ++at_border;
      EXPECT_EQ(p.depth, 0.0F);
    }
  }
  EXPECT_GT(at_border, 0);
  std::vector<int> near;
  found.grid.within(found.points, found.points[5].pixel.x(), found.points[5].pixel.y(), 0.1F, near);
  EXPECT_NE(std::find(near.begin(), near.end(), 5), near.end());
}

TEST(FeatureExtractor, EveryPointHasThePatchAroundIt) {
  sensor::RgbdFrame frame = textured_frame();
  frame.depth = cv::Mat();  // no border is known
  const FrameFeatures found = FeatureExtractor({}, kCamera).extract(frame);
  ASSERT_EQ(found.patches.size(), found.points.size());
  ASSERT_EQ(found.levels.size(), 8U);
  for (std::size_t i = 0; i < found.points.size(); ++i) {
    const CornerPatch& patch = found.patches[i];
    EXPECT_EQ(patch.middle, found.points[i].pixel);
    EXPECT_TRUE(patch.offset.isZero());
    EXPECT_FALSE(patch.empty());
    const cv::Mat& level = found.levels[static_cast<std::size_t>(found.points[i].octave)];
    const float shrink_x = static_cast<float>(level.cols) / static_cast<float>(frame.gray.cols);
    const float shrink_y = static_cast<float>(level.rows) / static_cast<float>(frame.gray.rows);
    const int x = cvRound((patch.middle.x() + 0.5F) * shrink_x - 0.5F);
    const int y = cvRound((patch.middle.y() + 0.5F) * shrink_y - 0.5F);
    EXPECT_EQ(patch.gray[CornerPatch::kPixels / 2], level.at<std::uint8_t>(y, x));
  }
}

TEST(FeatureExtractor, PatchesAreLeftEmptyWhereDepthJumpsOrIsMissing) {
  sensor::RgbdFrame frame = textured_frame();
  for (const float beyond : {3.0F, 0.0F}) {
    frame.depth(cv::Rect(320, 0, 320, 480)).setTo(beyond);
    const FrameFeatures found = FeatureExtractor({}, kCamera).extract(frame);
    int near = 0;
    int far = 0;
    for (std::size_t i = 0; i < found.points.size(); ++i) {
      const PointFeature& p = found.points[i];
      const float pixels = std::abs(p.pixel.x() - 319.5F) / std::pow(1.2F, static_cast<float>(p.octave));
      if (pixels > 0.5F && pixels < 3.0F) {
        ++near;
        EXPECT_TRUE(found.patches[i].empty()) << p.pixel.transpose() << " " << p.octave;
      } else if (pixels > 6.5F && (beyond > 0.0F || p.pixel.x() < 320.0F)) {
        ++far;
        EXPECT_FALSE(found.patches[i].empty()) << p.pixel.transpose() << " " << p.octave;
      }
    }
    EXPECT_GT(near, 5);
    EXPECT_GT(far, 250);
  }
}

TEST(FeatureExtractor, ThumbnailsAreSmallAndNeverMixDepth) {
  const sensor::RgbdFrame frame = textured_frame();
  const FrameFeatures found = FeatureExtractor({}, kCamera).extract(frame);
  EXPECT_EQ(found.thumbnail.size(), cv::Size(80, 60));
  EXPECT_EQ(found.thumbnail.type(), CV_32FC1);
  EXPECT_EQ(found.thumbnail_depth.size(), found.thumbnail.size());
  EXPECT_NEAR(cv::mean(found.thumbnail)[0], cv::mean(frame.gray)[0], 1.0);
  for (int y = 0; y < 60; ++y) {
    for (int x = 0; x < 80; ++x) {
      const float z = found.thumbnail_depth.at<float>(y, x);
      EXPECT_TRUE(z == (x < 40 ? 2.0F : 3.0F)) << x << " " << y << ": " << z;
    }
  }
}

TEST(FeatureExtractor, FamiliesCanBeSwitchedOff) {
  FeatureOptions options;
  options.points = false;
  sensor::RgbdFrame frame = textured_frame();
  cv::rectangle(frame.gray, {100, 100, 200, 200}, 255, cv::FILLED);
  const FrameFeatures lines_only = FeatureExtractor(options, kCamera).extract(frame);
  EXPECT_TRUE(lines_only.points.empty());
  EXPECT_FALSE(lines_only.lines.empty());
  options.points = true;
  options.lines = false;
  const FrameFeatures points_only = FeatureExtractor(options, kCamera).extract(frame);
  EXPECT_FALSE(points_only.points.empty());
  EXPECT_TRUE(points_only.lines.empty());
}

TEST(FeatureExtractor, BlankPicturesAndMissingDepthGiveEmptyFeatures) {
  sensor::RgbdFrame frame;
  EXPECT_TRUE(FeatureExtractor({}, kCamera).extract(frame).points.empty());
  frame.gray = cv::Mat(480, 640, CV_8UC1, cv::Scalar(0));
  const FrameFeatures blank = FeatureExtractor({}, kCamera).extract(frame);  // no depth picture at all
  EXPECT_TRUE(blank.points.empty());
  EXPECT_TRUE(blank.lines.empty());
  EXPECT_EQ(blank.thumbnail.size(), cv::Size(80, 60));
  EXPECT_EQ(cv::countNonZero(blank.thumbnail_depth), 0);
  frame = textured_frame();
  frame.depth.release();
  for (const PointFeature& p : FeatureExtractor({}, kCamera).extract(frame).points) EXPECT_EQ(p.depth, 0.0F);
}

}  // namespace
}  // namespace plumbline::features
