// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <limits>

#include "line_world.hpp"
#include "plumbline/features/line_depth.hpp"
#include "plumbline/features/line_extractor.hpp"
#include "plumbline/sensor/depth_noise.hpp"

namespace plumbline::features {
namespace {

const sensor::Pinhole kLineCamera{640, 480, 525.0, 525.0, 319.5, 239.5};

// Depth picture of the plane n . p = d.
cv::Mat plane(const Eigen::Vector3d& n, double d) {
  cv::Mat depth(480, 640, CV_32F);
  for (int y = 0; y < depth.rows; ++y) {
    for (int x = 0; x < depth.cols; ++x) {
      depth.at<float>(y, x) = static_cast<float>(d / n.dot(kLineCamera.unproject(x, y, 1.0)));
    }
  }
  return depth;
}

void add_noise(cv::Mat& depth, double factor, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  for (int y = 0; y < depth.rows; ++y) {
    for (int x = 0; x < depth.cols; ++x) {
      auto& z = depth.at<float>(y, x);
      z += static_cast<float>(factor * sensor::depth_sigma(static_cast<double>(z)) * normal(random));
    }
  }
}

const Eigen::Vector3d kSlanted = Eigen::Vector3d(0.4, -0.3, 0.86).normalized();

Eigen::Vector3d on_plane(const Eigen::Vector2f& pixel, const Eigen::Vector3d& n, double d) {
  const Eigen::Vector3d ray =
      kLineCamera.unproject(static_cast<double>(pixel.x()), static_cast<double>(pixel.y()), 1.0);
  return ray * (d / n.dot(ray));
}

TEST(LineDepth, IsExactOnAPlaneWithoutNoise) {
  const LineSegment s = world::segment(100.0F, 80.0F, 400.0F, 300.0F);
  const auto line = fit_line_depth(s, plane(kSlanted, 2.0), kLineCamera);
  ASSERT_TRUE(line);
  EXPECT_LT((line->start - on_plane(s.start, kSlanted, 2.0)).norm(), 2e-3);
  EXPECT_LT((line->end - on_plane(s.end, kSlanted, 2.0)).norm(), 2e-3);
  EXPECT_LT((kLineCamera.project(line->start) - s.start.cast<double>()).norm(), 1e-3);
  EXPECT_GT(line->inlier_share, 0.99);
  EXPECT_GT(line->coverage, 0.99);
}

TEST(LineDepth, CovarianceFitsTheErrorsOverManyNoisyLines) {
  const cv::Mat clean = plane(kSlanted, 2.0);
  const double pixel_sigma = 0.7;
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  double chi2 = 0.0;
  double depth_chi2 = 0.0;
  int count = 0;
  for (std::uint32_t round = 0; round < 6; ++round) {
    cv::Mat depth = clean.clone();
    add_noise(depth, 1.0, round);
    for (int k = 0; k < 50; ++k) {
      const double angle = world::uniform(random, 0.0, 6.28);
      const double length = world::uniform(random, 40.0, 160.0);
      const Eigen::Vector2d m(world::uniform(random, 200.0, 440.0), world::uniform(random, 200.0, 280.0));
      const Eigen::Vector2d h = 0.5 * length * Eigen::Vector2d(std::cos(angle), std::sin(angle));
      const Eigen::Vector2f a = (m - h).cast<float>();
      const Eigen::Vector2f b = (m + h).cast<float>();
      const Eigen::Vector2f wobble =
          (pixel_sigma * Eigen::Vector2d(normal(random), normal(random))).cast<float>();
      const Eigen::Vector2f other =
          (pixel_sigma * Eigen::Vector2d(normal(random), normal(random))).cast<float>();
      const Eigen::Vector2f a_seen = a + wobble;
      const Eigen::Vector2f b_seen = b + other;
      const auto line =
          fit_line_depth(world::segment(a_seen.x(), a_seen.y(), b_seen.x(), b_seen.y()), depth, kLineCamera);
      ASSERT_TRUE(line);
      const Eigen::Vector3d truth = on_plane(a, kSlanted, 2.0);
      const Eigen::Vector3d error = line->start - truth;
      const Eigen::Matrix3d covariance = endpoint_covariance(line->start, line->start_noise);
      chi2 += error.dot(covariance.inverse() * error);
      // Depth alone, against the truth on the ray that was seen.
      const double dz = line->start.z() - on_plane(a_seen, kSlanted, 2.0).z();
      depth_chi2 += dz * dz / covariance(2, 2);
      ++count;
    }
  }
  EXPECT_GT(chi2 / count, 2.0);  // three degrees of freedom
  EXPECT_LT(chi2 / count, 4.0);
  EXPECT_GT(depth_chi2 / count, 0.4);
  EXPECT_LT(depth_chi2 / count, 1.6);
}

TEST(LineDepth, CrossesHolesAndOutliers) {
  cv::Mat depth = plane(kSlanted, 2.0);
  add_noise(depth, 1.0, 9);
  std::mt19937 random(4);
  for (int y = 0; y < depth.rows; ++y) {
    for (int x = 0; x < depth.cols; ++x) {
      const double dice = world::uniform(random, 0.0, 1.0);
      if (dice < 0.4) depth.at<float>(y, x) = 0.0F;
      if (dice > 0.95) depth.at<float>(y, x) = static_cast<float>(world::uniform(random, 0.5, 6.0));
      if (dice > 0.99) depth.at<float>(y, x) = std::numeric_limits<float>::quiet_NaN();
    }
  }
  depth(cv::Rect(200, 0, 40, 480)).setTo(0.0F);
  const LineSegment s = world::segment(120.0F, 100.0F, 360.0F, 260.0F);
  const auto line = fit_line_depth(s, depth, kLineCamera);
  ASSERT_TRUE(line);
  EXPECT_LT((line->start - on_plane(s.start, kSlanted, 2.0)).norm(), 0.02);
  EXPECT_LT((line->end - on_plane(s.end, kSlanted, 2.0)).norm(), 0.02);
}

TEST(LineDepth, TakesTheForegroundAtAJump) {
  // A door leaf at 1.5 m ends at x = 300; behind it a wall at 3 m.
  cv::Mat depth(480, 640, CV_32F, cv::Scalar(3.0));
  depth.colRange(0, 300).setTo(1.5F);
  add_noise(depth, 1.0, 2);
  std::mt19937 random(6);  // a third of the depths along the jump is wild, many of them nearer than the door
  for (int y = 0; y < depth.rows; ++y) {
    for (int x = 299; x < 302; ++x) {
      if (random() % 3 == 0) depth.at<float>(y, x) = static_cast<float>(world::uniform(random, 0.2, 3.0));
    }
  }
  for (const float x : {298.0F, 299.5F, 301.0F}) {
    const auto line = fit_line_depth(world::segment(x, 60.0F, x, 400.0F), depth, kLineCamera);
    ASSERT_TRUE(line);
    EXPECT_NEAR(line->start.z(), 1.5, 0.01);
    EXPECT_NEAR(line->end.z(), 1.5, 0.01);
  }
  const auto behind = fit_line_depth(world::segment(310.0F, 60.0F, 310.0F, 400.0F), depth, kLineCamera);
  ASSERT_TRUE(behind);
  EXPECT_NEAR(behind->start.z(), 3.0, 0.03);
}

TEST(LineDepth, RefusesWhatDepthDoesNotSupport) {
  const LineSegment s = world::segment(100.0F, 200.0F, 500.0F, 200.0F);
  EXPECT_FALSE(fit_line_depth(s, cv::Mat(), kLineCamera));
  EXPECT_FALSE(fit_line_depth(s, cv::Mat(480, 640, CV_32F, cv::Scalar(0.0)), kLineCamera));
  EXPECT_FALSE(fit_line_depth(
      s, cv::Mat(480, 640, CV_32F, cv::Scalar(std::numeric_limits<float>::quiet_NaN())), kLineCamera));
  EXPECT_FALSE(fit_line_depth(s, cv::Mat(480, 640, CV_32F, cv::Scalar(50.0)), kLineCamera));
  EXPECT_FALSE(fit_line_depth(world::segment(5, 5, 5, 5), plane(kSlanted, 2.0), kLineCamera));
  EXPECT_FALSE(fit_line_depth(world::segment(-900, -900, -800, -800), plane(kSlanted, 2.0), kLineCamera));

  cv::Mat third = plane(kSlanted, 2.0);  // depth under a third of the line only
  third.colRange(230, 640).setTo(0.0F);
  EXPECT_FALSE(fit_line_depth(s, third, kLineCamera));

  cv::Mat steps(480, 640, CV_32F);  // four stairs: no one line
  for (int x = 0; x < 640; ++x) steps.col(x).setTo(1.0 + 0.5 * (x / 110 % 4));
  EXPECT_FALSE(fit_line_depth(s, steps, kLineCamera));

  cv::Mat confetti(480, 640, CV_32F);
  std::mt19937 random(8);
  for (int y = 0; y < 480; ++y) {
    for (int x = 0; x < 640; ++x)
      confetti.at<float>(y, x) = static_cast<float>(world::uniform(random, 0.8, 5.0));
  }
  EXPECT_FALSE(fit_line_depth(s, confetti, kLineCamera));
}

TEST(LineExtractor, GivesSegmentsDescriptorsAndLinesInSpace) {
  world::Polygon sheet;
  sheet.gray = 220.0;
  sheet.corners = {{150.0, 120.0}, {470.0, 140.0}, {450.0, 380.0}, {170.0, 350.0}};
  const cv::Mat image = world::disturb(world::render(640, 480, 90.0, {sheet}), 2.0, 1.0, 0.0, 3);
  cv::Mat depth = plane(kSlanted, 2.0);
  add_noise(depth, 1.0, 1);
  const LineExtractor extractor;
  const std::vector<LineFeature> features = extractor.extract(image, depth, kLineCamera);
  ASSERT_EQ(features.size(), 4U);
  for (std::size_t i = 0; i < features.size(); ++i) {
    ASSERT_TRUE(features[i].line3);
    EXPECT_LT((features[i].line3->start - on_plane(features[i].segment.start, kSlanted, 2.0)).norm(), 0.02);
    EXPECT_NE(features[i].descriptor, LineDescriptor{});
  }
  const std::vector<LineFeature> flat = extractor.extract(image, cv::Mat(), kLineCamera);
  ASSERT_EQ(flat.size(), 4U);
  for (const LineFeature& f : flat) EXPECT_FALSE(f.line3);
  EXPECT_TRUE(extractor.extract(cv::Mat(), cv::Mat(), kLineCamera).empty());
  EXPECT_TRUE(extractor.extract(cv::Mat(480, 640, CV_8U, cv::Scalar(255)), depth, kLineCamera).empty());
}

TEST(LineOptions, AreDeclaredOnceEach) {
  LineOptions options;
  core::OptionTable table;
  options.declare(table);
  std::vector<std::string> keys;
  for (const core::OptionSpec& s : table.specs()) keys.push_back(s.key);
  std::vector<std::string> unique = keys;
  std::sort(unique.begin(), unique.end());
  unique.erase(std::unique(unique.begin(), unique.end()), unique.end());
  EXPECT_EQ(unique.size(), keys.size());
  core::ConfigNode edlines;
  edlines.kind = core::ConfigNode::Kind::kScalar;
  edlines.scalar = "edlines";
  core::ConfigProblems problems;
  table.set("line.detector", edlines, "features", problems);
  EXPECT_TRUE(problems.empty());
  EXPECT_EQ(options.detector.method, LineMethod::kEdlines);
}

}  // namespace
}  // namespace plumbline::features
