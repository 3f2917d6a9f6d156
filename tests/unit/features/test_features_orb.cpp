// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <random>

#include "plumbline/features/orb.hpp"

namespace plumbline::features {
namespace {

/// Blurred noise: corners everywhere.
cv::Mat texture(int width, int height, std::uint32_t seed = 1) {
  cv::Mat image(height, width, CV_8UC1);
  cv::RNG random(seed);
  random.fill(image, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(image, image, {5, 5}, 1.0);
  cv::normalize(image, image, 0, 255, cv::NORM_MINMAX);
  return image;
}

OrbFeatures extract(const cv::Mat& image, const OrbOptions& options = {}) {
  return OrbExtractor(options).extract(image, {0, 0, image.cols, image.rows});
}

TEST(Orb, EveryNinthOfATexturedPictureHasItsShare) {
  const OrbFeatures found = extract(texture(640, 480));
  EXPECT_EQ(found.points.size(), found.descriptors.size());
  EXPECT_NEAR(static_cast<double>(found.points.size()), 1000.0, 30.0);
  std::array<int, 9> count{};
  for (const PointFeature& p : found.points) {
    const int x = std::min(2, static_cast<int>(p.pixel.x() / 640.0F * 3.0F));
    const int y = std::min(2, static_cast<int>(p.pixel.y() / 480.0F * 3.0F));
    ++count[static_cast<std::size_t>(3 * y + x)];
  }
  for (int c : count) EXPECT_GT(c, 60);
}

TEST(Orb, WeakTextureGetsItsPointsBesideStrong) {
  cv::Mat image = texture(640, 480);
  cv::Mat left = image(cv::Rect(0, 0, 320, 480));
  left.convertTo(left, CV_8U, 0.12, 110.0);  // a tenth of the contrast
  const OrbFeatures found = extract(image);
  int weak = 0;
  for (const PointFeature& p : found.points) weak += p.pixel.x() < 310.0F ? 1 : 0;
  EXPECT_GT(weak, 250);
}

/// Squares are the same on all sides: what is found around them has its mean in their middle, in every
/// octave.
TEST(Orb, CornersLieWhereTheyAreInEveryOctave) {
  constexpr int kFiner = 8;
  cv::Mat image(kFiner * 960, kFiner * 1280, CV_8UC1, cv::Scalar(220));
  std::vector<Eigen::Vector2f> middles;
  std::mt19937 random(1);
  for (int y = 60; y < 920; y += 52) {
    for (int x = 60; x < 1240; x += 52) {
      constexpr int kHalf = kFiner * 12;
      const int u = kFiner * x + static_cast<int>(random() % 17);  // any part of a pixel
      const int v = kFiner * y + static_cast<int>(random() % 17);
      const cv::Rect square(u - kHalf, v - kHalf, 2 * kHalf, 2 * kHalf);
      cv::rectangle(image, square, cv::Scalar(60), cv::FILLED);
      const auto middle = [](int at) { return static_cast<float>(at) / kFiner - 0.5F; };
      middles.emplace_back(middle(u), middle(v));
    }
  }
  cv::resize(image, image, {1280, 960}, 0.0, 0.0, cv::INTER_AREA);
  cv::GaussianBlur(image, image, {5, 5}, 1.0);
  OrbOptions options;
  options.count = 20000;
  std::array<Eigen::Vector2f, 8> sum{};
  std::array<int, 8> count{};
  sum.fill(Eigen::Vector2f::Zero());
  for (const PointFeature& p : extract(image, options).points) {
    const auto nearest = std::min_element(middles.begin(), middles.end(), [&](const auto& a, const auto& b) {
      return (a - p.pixel).squaredNorm() < (b - p.pixel).squaredNorm();
    });
    sum[static_cast<std::size_t>(p.octave)] += p.pixel - *nearest;
    ++count[static_cast<std::size_t>(p.octave)];
  }
  for (std::size_t octave = 0; octave < count.size(); ++octave) {
    ASSERT_GT(count[octave], 150) << octave;
    const Eigen::Vector2f mean = sum[octave] / static_cast<float>(count[octave]);
    EXPECT_LT(mean.cwiseAbs().maxCoeff(), 0.2F) << octave << ": " << mean.transpose();
  }
}

/// A board: a dark frame a little out of level on a noisy wall, as a camera sees it.
cv::Mat board() {
  cv::Mat image(4 * 480, 4 * 640, CV_8UC1, cv::Scalar(200));
  const std::vector<cv::Point> frame{{600, 420}, {1960, 300}, {2000, 1500}, {560, 1560}};
  cv::polylines(image, frame, true, cv::Scalar(90), 24, cv::LINE_AA);
  cv::resize(image, image, {640, 480}, 0.0, 0.0, cv::INTER_AREA);
  cv::Mat noise(image.size(), CV_16SC1);
  cv::RNG random(3);
  random.fill(noise, cv::RNG::NORMAL, 0.0, 2.0);
  cv::add(image, noise, image, cv::noArray(), CV_8U);
  return image;
}

TEST(Orb, PointsLieAtCornersAndNotAlongEdges) {
  const std::array<Eigen::Vector2f, 4> corners{
      Eigen::Vector2f(150.0F, 105.0F), Eigen::Vector2f(490.0F, 75.0F), Eigen::Vector2f(500.0F, 375.0F),
      Eigen::Vector2f(140.0F, 390.0F)};
  const auto count = [&](const OrbFeatures& found) {
    std::array<int, 2> at_corners_along_edges{};
    for (const PointFeature& p : found.points) {
      const bool corner = std::any_of(corners.begin(), corners.end(),
                                      [&](const Eigen::Vector2f& c) { return (c - p.pixel).norm() < 25.0F; });
      ++at_corners_along_edges[corner ? 0 : 1];
    }
    return at_corners_along_edges;
  };
  OrbOptions all;
  all.min_corner = 0.0;
  const auto [corners_of_all, edges_of_all] = count(extract(board(), all));
  const auto [at_corners, along_edges] = count(extract(board()));
  EXPECT_GT(edges_of_all, 30);
  EXPECT_LT(along_edges, edges_of_all / 4);
  EXPECT_GT(at_corners, 8);
  EXPECT_GT(at_corners, 2 * corners_of_all / 3);
}

TEST(Orb, AllOctavesAreUsedAndInRange) {
  const OrbFeatures found = extract(texture(640, 480));
  std::array<int, 8> count{};
  for (const PointFeature& p : found.points) {
    ASSERT_GE(p.octave, 0);
    ASSERT_LT(p.octave, 8);
    ++count[static_cast<std::size_t>(p.octave)];
    EXPECT_GE(p.angle, 0.0F);
    EXPECT_LT(p.angle, 360.01F);
    EXPECT_EQ(p.depth, 0.0F);
  }
  for (int c : count) EXPECT_GT(c, 10);
  EXPECT_GT(count[0], count[7]);
  const OrbExtractor extractor({});
  EXPECT_FLOAT_EQ(extractor.sigma(0), 1.0F);
  EXPECT_NEAR(extractor.sigma(3), 1.728F, 1e-4F);
}

TEST(Orb, SameBytesTwice) {
  const OrbFeatures a = extract(texture(320, 240));
  const OrbFeatures b = extract(texture(320, 240));
  ASSERT_EQ(a.points.size(), b.points.size());
  EXPECT_EQ(a.descriptors, b.descriptors);
  for (std::size_t i = 0; i < a.points.size(); ++i) {
    EXPECT_EQ(a.points[i].pixel, b.points[i].pixel);
    EXPECT_EQ(a.points[i].angle, b.points[i].angle);
  }
}

TEST(Orb, BlankAndTinyPicturesHaveNoPoints) {
  for (int grey : {0, 128, 255})
    EXPECT_TRUE(extract(cv::Mat(480, 640, CV_8UC1, cv::Scalar(grey))).points.empty());
  EXPECT_TRUE(extract(texture(30, 30)).points.empty());
  EXPECT_TRUE(extract(texture(640, 20)).points.empty());
  EXPECT_TRUE(extract(cv::Mat(1, 1, CV_8UC1, cv::Scalar(0))).points.empty());
  EXPECT_FALSE(extract(texture(100, 100)).points.empty());
}

TEST(Orb, StaysInTheRegion) {
  const cv::Rect region(200, 120, 240, 200);
  const OrbFeatures found = OrbExtractor({}).extract(texture(640, 480), region);
  ASSERT_GT(found.points.size(), 200U);
  for (const PointFeature& p : found.points) {
    EXPECT_TRUE(region.contains(cv::Point2f(p.pixel.x(), p.pixel.y()))) << p.pixel.transpose();
  }
  EXPECT_TRUE(OrbExtractor({}).extract(texture(640, 480), {300, 300, 10, 10}).points.empty());
  EXPECT_TRUE(OrbExtractor({}).extract(texture(640, 480), {}).points.empty());
}

TEST(Orb, CountIsHonoured) {
  OrbOptions options;
  options.count = 200;
  EXPECT_NEAR(static_cast<double>(extract(texture(640, 480), options).points.size()), 200.0, 10.0);
  options.levels = 1;
  const OrbFeatures found = extract(texture(640, 480), options);
  EXPECT_EQ(found.points.size(), 200U);
  for (const PointFeature& p : found.points) EXPECT_EQ(p.octave, 0);
}

/// A quarter turn clockwise moves pixel (x, y) to (height - 1 - y, x).
Eigen::Vector2f turned(const Eigen::Vector2f& p, int height) {
  return {static_cast<float>(height - 1) - p.y(), p.x()};
}

TEST(Orb, AQuarterTurnTurnsOrientationsAndKeepsDescriptors) {
  const cv::Mat image = texture(400, 400, 5);
  cv::Mat quarter;
  cv::rotate(image, quarter, cv::ROTATE_90_CLOCKWISE);
  OrbOptions options;
  options.levels = 1;  // resizing does not commute with turning
  const OrbFeatures a = extract(image, options);
  const OrbFeatures b = extract(quarter, options);
  int same_place = 0;
  int good_angle = 0;
  int good_descriptor = 0;
  int first = 0;
  for (std::size_t i = 0; i < a.points.size(); ++i) {
    const Eigen::Vector2f expected = turned(a.points[i].pixel, image.rows);
    for (std::size_t j = 0; j < b.points.size(); ++j) {
      if ((b.points[j].pixel - expected).norm() > 0.5F) continue;
      ++same_place;
      float difference = std::fmod(b.points[j].angle - a.points[i].angle - 90.0F + 720.0F, 360.0F);
      difference = std::min(difference, 360.0F - difference);
      good_angle += difference < 2.0F ? 1 : 0;
      good_descriptor += hamming_distance(a.descriptors[i], b.descriptors[j]) < 40 ? 1 : 0;
      // And nothing else looks as much alike.
      int nearest = 257;
      for (std::size_t k = 0; k < b.points.size(); ++k) {
        if (k != j) nearest = std::min(nearest, hamming_distance(a.descriptors[i], b.descriptors[k]));
      }
      first += hamming_distance(a.descriptors[i], b.descriptors[j]) < nearest ? 1 : 0;
    }
  }
  EXPECT_GT(same_place, static_cast<int>(a.points.size()) * 6 / 10);
  EXPECT_GT(good_angle, same_place * 97 / 100);
  EXPECT_GT(good_descriptor, same_place * 95 / 100);
  EXPECT_GT(first, same_place * 97 / 100);
}

TEST(Descriptor, HammingDistanceCountsBits) {
  const Descriptor256 zero{};
  Descriptor256 all;
  all.fill(~0ULL);
  EXPECT_EQ(hamming_distance(zero, zero), 0);
  EXPECT_EQ(hamming_distance(zero, all), 256);
  const Descriptor256 some{1ULL, 1ULL << 63, 0x0FULL, 0};
  EXPECT_EQ(hamming_distance(zero, some), 6);
  std::mt19937_64 random(3);
  std::vector<Descriptor256> list(50);
  for (auto& d : list) d = {random(), random(), random(), random()};
  std::vector<int> distances(list.size());
  hamming_distances(list[7], list.data(), list.size(), distances.data());
  for (std::size_t i = 0; i < list.size(); ++i) EXPECT_EQ(distances[i], hamming_distance(list[7], list[i]));
}

}  // namespace
}  // namespace plumbline::features
