// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "line_recall.hpp"
#include "plumbline/features/lbd.hpp"
#include "plumbline/features/line_match.hpp"

namespace plumbline::features {
namespace {

std::vector<LineFeature> describe(const world::View& view) {
  const std::vector<LineDescriptor> descriptors = describe_lines(view.image, view.lines);
  std::vector<LineFeature> result;
  for (std::size_t i = 0; i < descriptors.size(); ++i) result.push_back({view.lines[i], descriptors[i], {}});
  return result;
}

TEST(Lbd, StatisticsAreNormalisedAndFinite) {
  const cv::Mat image = world::render(320, 240, 90.0, world::clutter(25, 320, 240, 4));
  const std::vector<LineSegment> lines = LineDetector().detect(image);
  ASSERT_GT(lines.size(), 5U);
  for (const BandStatistics& s : band_statistics(image, lines)) {
    float sum = 0.0F;
    for (float v : s) {
      EXPECT_GE(v, 0.0F);
      sum += v * v;
    }
    EXPECT_NEAR(sum, 1.0F, 1e-4F);
  }
}

TEST(Lbd, SeesTheStepAcrossTheLineInTheMiddleBand) {
  // Bright above, dark below; the line runs to the right, so the step is across, away from the normal.
  cv::Mat image(200, 200, CV_8U, cv::Scalar(200));
  image.rowRange(100, 200).setTo(50);
  const BandStatistics s = band_statistics(image, {world::segment(60.0F, 99.5F, 140.0F, 99.5F)})[0];
  for (std::size_t band = 0; band < 9; ++band) {
    EXPECT_NEAR(s[8 * band + 0], 0.0F, 1e-6F);  // along +
    EXPECT_NEAR(s[8 * band + 1], 0.0F, 1e-6F);  // along -
    EXPECT_NEAR(s[8 * band + 2], 0.0F, 1e-6F);  // across +: brighter to the right
    EXPECT_LE(s[8 * band + 3], s[8 * 4 + 3]);
  }
  EXPECT_GT(s[8 * 4 + 3], 0.3F);
}

TEST(Lbd, IsUnmovedByBrightness) {
  const cv::Mat image = world::render(320, 240, 90.0, world::clutter(25, 320, 240, 4));
  const std::vector<LineSegment> lines = LineDetector().detect(image);
  const std::vector<LineDescriptor> plain = describe_lines(image, lines);
  const std::vector<LineDescriptor> darker = describe_lines(world::disturb(image, 0.0, 0.6, 20.0, 1), lines);
  double sum = 0.0;
  for (std::size_t i = 0; i < plain.size(); ++i) sum += hamming(plain[i], darker[i]);
  EXPECT_LT(sum / static_cast<double>(plain.size()), 8.0);
}

TEST(Lbd, IsUnmovedByAHalfTurn) {
  const cv::Mat image = world::render(320, 240, 90.0, world::clutter(25, 320, 240, 4));
  cv::Mat turned;
  cv::rotate(image, turned, cv::ROTATE_180);
  std::vector<LineSegment> lines = LineDetector().detect(image);
  std::vector<LineSegment> turned_lines = lines;
  for (LineSegment& l : turned_lines) {
    l.start = Eigen::Vector2f(319.0F, 239.0F) - l.start;
    l.end = Eigen::Vector2f(319.0F, 239.0F) - l.end;
  }
  const std::vector<LineDescriptor> a = describe_lines(image, lines);
  const std::vector<LineDescriptor> b = describe_lines(turned, turned_lines);
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += hamming(a[i], b[i]);
  EXPECT_LT(sum / static_cast<double>(a.size()), 12.0);
}

TEST(Lbd, TakesDegenerateInput) {
  const cv::Mat blank(60, 80, CV_8U, cv::Scalar(77));
  EXPECT_TRUE(describe_lines(blank, {}).empty());
  EXPECT_TRUE(describe_lines(cv::Mat(), {}).empty());
  // No gradient anywhere; a segment of no length; one that leaves the picture on both sides; a tiny picture.
  const LineDescriptor zero{};
  EXPECT_EQ(describe_lines(blank, {world::segment(10, 10, 70, 10)})[0], zero);
  EXPECT_EQ(describe_lines(blank, {world::segment(10, 10, 10, 10)})[0], zero);
  EXPECT_EQ(describe_lines(blank, {world::segment(-500, 10, 900, 50)})[0], zero);
  EXPECT_EQ(describe_lines(cv::Mat(2, 2, CV_8U, cv::Scalar(1)), {world::segment(0, 0, 1, 1)})[0], zero);
}

TEST(Lbd, FindsTheSameEdgesInMovedPictures) {
  // Floors slightly below the measured values.
  world::RecallMeter all;
  for (const world::ViewPair& pair : world::view_pairs()) {
    const auto [a, b] = world::make_views(pair, 1);
    all.add(a, b, describe_lines);
    if (pair.name == "small motion") {
      world::RecallMeter small;
      small.add(a, b, describe_lines);
      EXPECT_GT(small.recall(0.95), 0.80);
    }
  }
  ASSERT_GT(all.possible(), 300);
  EXPECT_GT(all.recall(0.90), 0.65);
  EXPECT_GT(all.precision(), 0.88);
}

TEST(LineMatch, PairsTheSameEdgesWithFewErrors) {
  const auto [a, b] = world::make_views(world::view_pairs()[0], 2);
  const std::vector<LineMatch> matches = match_lines(describe(a), describe(b));
  ASSERT_GT(matches.size(), a.lines.size() / 2);
  int right = 0;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    right +=
        a.edges[static_cast<std::size_t>(matches[i].a)] == b.edges[static_cast<std::size_t>(matches[i].b)];
    EXPECT_TRUE(i == 0 || matches[i].a > matches[i - 1].a);
  }
  EXPECT_GT(right, static_cast<int>(0.95 * static_cast<double>(matches.size())));
}

TEST(LineMatch, HonoursItsGates) {
  const LineSegment base = world::segment(0, 0, 100, 0);
  const auto matched = [&](const LineSegment& other) {
    return match_lines({{base, {}, {}}}, {{other, {}, {}}}).size();
  };
  EXPECT_EQ(matched(world::segment(0, 40, 100, 40)), 1U);
  EXPECT_EQ(matched(world::segment(100, 0, 0, 0)), 0U);   // opposite step
  EXPECT_EQ(matched(world::segment(0, 0, 100, 50)), 0U);  // turned by 0.46 rad
  EXPECT_EQ(matched(world::segment(0, 0, 30, 0)), 0U);    // too short
  EXPECT_NEAR(overlap(base, world::segment(60, 10, 160, 10)), 0.4, 1e-5);
  EXPECT_EQ(overlap(base, world::segment(200, 0, 300, 0)), 0.0);
}

TEST(LineMatch, RefusesTheAmbiguousAndTheFar) {
  const auto line = [](const LineDescriptor& descriptor) {
    return LineFeature{world::segment(0, 0, 100, 0), descriptor, {}};
  };
  const LineFeature zero = line({});
  const LineFeature near = line({0xFFULL, 0, 0, 0});
  const LineFeature far = line({~0ULL, ~0ULL, 0, 0});
  EXPECT_EQ(hamming(zero.descriptor, near.descriptor), 8);
  EXPECT_EQ(hamming(zero.descriptor, far.descriptor), 128);
  EXPECT_EQ(match_lines({zero}, {far}).size(), 0U);
  EXPECT_EQ(match_lines({zero}, {near, near}).size(), 0U);
  EXPECT_EQ(match_lines({zero}, {near, far}).size(), 1U);
  // Two want the same: only its own best gets it.
  const std::vector<LineMatch> mutual = match_lines({near, zero}, {zero});
  ASSERT_EQ(mutual.size(), 1U);
  EXPECT_EQ(mutual[0].a, 1);
  EXPECT_TRUE(match_lines({}, {zero}).empty());
  EXPECT_TRUE(match_lines({zero}, {}).empty());
}

}  // namespace
}  // namespace plumbline::features
