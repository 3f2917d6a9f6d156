// SPDX-License-Identifier: BSD-3-Clause
// Depth images taken a little after the colour image, of a slanted wall whose depth is known everywhere.
#include <gtest/gtest.h>

#include "plumbline/features/depth_delay.hpp"

namespace plumbline::features {
namespace {

using geometry::Rigid3;

const sensor::Pinhole kSmallCamera{320, 240, 260.0, 260.0, 159.5, 119.5};
const Eigen::Vector3d kNormal = Eigen::Vector3d(0.6, 0.2, -1.0).normalized();  // colour camera's frame
constexpr double kDistance = -2.0;                                             // n.p = kDistance

/// Depth of the wall at a pixel of a camera that lies `here_from_colour` beside the colour camera.
double wall_depth(double u, double v, const Rigid3& here_from_colour) {
  const Eigen::Vector3d n = here_from_colour.rotation * kNormal;
  const double d = kDistance + n.dot(here_from_colour.translation);
  return d / n.dot(kSmallCamera.unproject(u, v, 1.0));
}

cv::Mat wall(const Rigid3& here_from_colour) {
  cv::Mat depth(kSmallCamera.height, kSmallCamera.width, CV_32FC1);
  for (int v = 0; v < depth.rows; ++v) {
    for (int u = 0; u < depth.cols; ++u)
      depth.at<float>(v, u) = static_cast<float>(wall_depth(u, v, here_from_colour));
  }
  return depth;
}

/// Points and lines with what the depth image says at their own pixels.
FrameFeatures seen_in(const cv::Mat& depth) {
  FrameFeatures features;
  for (int v = 40; v < 200; v += 20) {
    for (int u = 40; u < 280; u += 20) {
      PointFeature point;
      point.pixel = Eigen::Vector2f(static_cast<float>(u), static_cast<float>(v));
      point.depth = corner_depth(depth, point.pixel.x(), point.pixel.y()).z;
      features.points.push_back(point);
    }
  }
  for (float v : {60.0F, 120.0F, 180.0F}) {
    LineFeature line;
    line.segment.start = {60.0F, v};
    line.segment.end = {250.0F, v + 20.0F};
    line.line3 = fit_line_depth(line.segment, depth, kSmallCamera);
    features.lines.push_back(line);
  }
  return features;
}

const Rigid3 kMotion(geometry::exp_so3({0.01, -0.03, 0.0}), Eigen::Vector3d(0.01, 0.0, -0.02));

TEST(DepthDelay, DepthIsThatOfTheColourImagesMoment) {
  const cv::Mat depth = wall(kMotion);
  FrameFeatures features = seen_in(depth);
  double worst_before = 0.0;
  const auto error = [](const PointFeature& p) {
    return std::abs(static_cast<double>(p.depth) -
                    wall_depth(static_cast<double>(p.pixel.x()), static_cast<double>(p.pixel.y()), {}));
  };
  for (const PointFeature& p : features.points) worst_before = std::max(worst_before, error(p));
  ASSERT_GT(worst_before, 0.03);
  undo_point_depth_delay(features, depth, kSmallCamera, kMotion);
  undo_line_depth_delay(features, depth, kSmallCamera, kMotion);
  // The depth camera's pixel is taken at the depth first read: its error of 5 cm leaves a tenth of a pixel,
  // and a pixel is rounded.
  for (const PointFeature& p : features.points) {
    ASSERT_GT(p.depth, 0.0F);
    EXPECT_LT(error(p), 0.008) << p.pixel.transpose();
  }
  for (const LineFeature& line : features.lines) {
    ASSERT_TRUE(line.line3.has_value());
    EXPECT_NEAR(kNormal.dot(line.line3->start), kDistance, 0.006);
    EXPECT_NEAR(kNormal.dot(line.line3->end), kDistance, 0.006);
    EXPECT_LT((kSmallCamera.project(line.line3->start) - line.segment.start.cast<double>()).norm(), 0.3)
        << "still before its pixel";
  }
}

TEST(DepthDelay, NoMotionChangesNothingToSpeakOf) {
  const cv::Mat depth = wall({});
  const FrameFeatures before = seen_in(depth);
  FrameFeatures after = before;
  undo_point_depth_delay(after, depth, kSmallCamera, {});
  for (std::size_t i = 0; i < before.points.size(); ++i)
    EXPECT_NEAR(after.points[i].depth, before.points[i].depth, 1e-5F);
}

TEST(DepthDelay, WithoutDepthThereIsNone) {
  const cv::Mat depth = wall(kMotion);
  FrameFeatures features = seen_in(depth);
  features.points[0].depth = 0.0F;
  features.lines[0].line3.reset();
  undo_point_depth_delay(features, depth, kSmallCamera, kMotion);
  undo_line_depth_delay(features, depth, kSmallCamera, kMotion);
  EXPECT_EQ(features.points[0].depth, 0.0F);
  EXPECT_FALSE(features.lines[0].line3.has_value());
  // Where the depth camera sees nothing what was there is gone.
  const cv::Mat nothing(kSmallCamera.height, kSmallCamera.width, CV_32FC1, cv::Scalar(0));
  undo_point_depth_delay(features, nothing, kSmallCamera, kMotion);
  undo_line_depth_delay(features, nothing, kSmallCamera, kMotion);
  for (const PointFeature& p : features.points) EXPECT_EQ(p.depth, 0.0F);
  for (const LineFeature& l : features.lines) EXPECT_FALSE(l.line3.has_value());
  // No depth image at all, and a move that puts everything behind the depth camera.
  FrameFeatures again = seen_in(depth);
  const float kept = again.points[5].depth;
  undo_point_depth_delay(again, cv::Mat(), kSmallCamera, kMotion);
  EXPECT_EQ(again.points[5].depth, kept);
  undo_point_depth_delay(again, depth, kSmallCamera, Rigid3(Eigen::Matrix3d::Identity(), {0.0, 0.0, -10.0}));
  for (const PointFeature& p : again.points) EXPECT_GE(p.depth, 0.0F);
}

}  // namespace
}  // namespace plumbline::features
