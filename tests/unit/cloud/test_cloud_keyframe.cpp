// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>

#include "plumbline/cloud/fusion/keyframe_cloud.hpp"
#include "test_cloud_worlds.hpp"

namespace plumbline::cloud {
namespace {

using worlds::camera;
using worlds::frame_of;
using worlds::plane_depth;

constexpr double kDegree = 3.14159265358979323846 / 180.0;

struct NormalErrors {
  double share = 0.0;   ///< of the points that have a normal
  double median = 0.0;  ///< degrees
  double p95 = 0.0;
  double bias = 0.0;  ///< of the mean normal
};

/// Errors of the normals of cells with columns in [from, to) against `truth` (towards the camera).
NormalErrors normal_errors(const Cloud& cloud, const Eigen::Vector3d& truth, int from, int to) {
  std::vector<double> errors;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double points = 0.0;
  for (int j = 0; j < static_cast<int>(cloud.height); ++j) {
    for (int i = from; i < to; ++i) {
      const Point& p = cloud(i, j);
      if (!std::isfinite(p.z)) continue;
      points += 1.0;
      if (!std::isfinite(p.normal_x)) continue;
      const Eigen::Vector3d n = p.getNormalVector3fMap().cast<double>();
      EXPECT_NEAR(n.norm(), 1.0, 1e-4);
      EXPECT_LE(n.dot(p.getVector3fMap().cast<double>()), 0.0);
      errors.push_back(std::acos(std::clamp(n.dot(truth), -1.0, 1.0)) / kDegree);
      sum += n;
    }
  }
  if (errors.empty()) return {};
  std::sort(errors.begin(), errors.end());
  return {static_cast<double>(errors.size()) / points, errors[errors.size() / 2],
          errors[errors.size() * 95 / 100],
          std::acos(std::clamp(sum.normalized().dot(truth), -1.0, 1.0)) / kDegree};
}

TEST(KeyframeCloud, PointsAreTheUnprojectedPixelsWithTheirColour) {
  cv::Mat depth = plane_depth({0, 0, 1}, 2.0, 0.0);
  depth.at<float>(10, 20) = 0.0F;
  depth.at<float>(12, 20) = std::numeric_limits<float>::quiet_NaN();
  depth.at<float>(14, 20) = 30.0F;
  auto frame = frame_of(depth);
  frame.color.at<cv::Vec3b>(100, 200) = cv::Vec3b(1, 2, 3);
  const auto cloud = organised_cloud(frame, camera());
  ASSERT_EQ(cloud->width, 320U);
  ASSERT_EQ(cloud->height, 240U);
  EXPECT_FALSE(cloud->is_dense);
  const Point& p = (*cloud)(100, 50);
  const Eigen::Vector3d expected = camera().unproject(200, 100, 2.0);
  EXPECT_NEAR(p.x, expected.x(), 1e-6);
  EXPECT_NEAR(p.y, expected.y(), 1e-6);
  EXPECT_EQ(p.z, 2.0F);
  EXPECT_EQ(p.b, 1);
  EXPECT_EQ(p.r, 3);
  for (int j : {5, 6, 7}) EXPECT_TRUE(std::isnan((*cloud)(10, j).x));
  EXPECT_EQ(worlds::finite_points(*cloud), 320U * 240U - 3U);
}

TEST(KeyframeCloud, PlaneNormalsAreExactWithoutNoiseUpToTheBorder) {
  for (const Eigen::Vector3d& direction :
       {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(0.7, 0, 0.7), Eigen::Vector3d(0.2, 0.8, 0.5),
        Eigen::Vector3d(-0.4, -0.4, 0.8)}) {
    const Eigen::Vector3d normal = direction.normalized();
    for (int stride : {1, 2, 3}) {
      KeyframeCloudOptions options;
      options.stride_px = stride;
      const auto cloud = organised_cloud(frame_of(plane_depth(normal, 1.2, 0.0)), camera(), options);
      const auto errors = normal_errors(*cloud, -normal, 0, static_cast<int>(cloud->width));
      EXPECT_GT(errors.share, 0.98) << direction.transpose() << " stride " << stride;
      EXPECT_LT(errors.p95, 0.2) << direction.transpose() << " stride " << stride;
    }
  }
}

TEST(KeyframeCloud, TheStrideFollowsTheWidthUnlessItIsGiven) {
  KeyframeCloudOptions options;
  EXPECT_EQ(options.stride(320), 2);
  EXPECT_EQ(options.stride(640), 2);
  EXPECT_EQ(options.stride(848), 2);
  EXPECT_EQ(options.stride(1280), 3);
  EXPECT_EQ(options.stride(1920), 4);
  options.stride_px = 1;
  EXPECT_EQ(options.stride(1920), 1);
}

TEST(KeyframeCloud, NormalsUnderStructuredLightNoiseAreWithinADegree) {
  for (const double angle : {0.0, 30.0, 50.0}) {
    for (const double distance : {1.0, 2.0, 3.0}) {
      const Eigen::Vector3d normal(std::sin(angle * kDegree), 0.0, std::cos(angle * kDegree));
      // The distance is that of the point in the middle of the picture.
      const auto cloud = organised_cloud(frame_of(plane_depth(normal, distance * normal.z(), 1.0)), camera());
      const auto errors = normal_errors(*cloud, -normal, 110, 210);
      EXPECT_GT(errors.share, 0.99);
      EXPECT_LT(errors.median, 1.0) << angle << " deg, " << distance << " m";
      EXPECT_LT(errors.p95, 2.5) << angle << " deg, " << distance << " m";
      EXPECT_LT(errors.bias, 0.1) << angle << " deg, " << distance << " m";
    }
  }
}

TEST(KeyframeCloud, NormalsKeepToTheirSideOfAStepEdge) {
  const Eigen::Vector3d slanted = Eigen::Vector3d(0.5, 0.0, 1.0).normalized();
  cv::Mat depth = plane_depth({0, 0, 1}, 2.0, 0.5);
  plane_depth(slanted, 1.0, 0.5)(cv::Rect(320, 0, 320, 480)).copyTo(depth(cv::Rect(320, 0, 320, 480)));
  const auto cloud = organised_cloud(frame_of(depth), camera());
  const auto left = normal_errors(*cloud, {0, 0, -1}, 150, 160);
  const auto right = normal_errors(*cloud, -slanted, 160, 170);
  EXPECT_GT(left.share, 0.95);
  EXPECT_GT(right.share, 0.95);
  EXPECT_LT(left.p95, 3.0);
  EXPECT_LT(right.p95, 3.0);
}

TEST(KeyframeCloud, NormalsKeepToTheirSideOfACrease) {
  // A room's corner: two walls at 90 degrees that meet at x = 0, 2 m away.
  const Eigen::Vector3d left_wall = Eigen::Vector3d(-1, 0, 1).normalized();
  const Eigen::Vector3d right_wall = Eigen::Vector3d(1, 0, 1).normalized();
  const double distance = 2.0 * left_wall.z();
  cv::Mat depth = plane_depth(left_wall, distance, 0.5);
  plane_depth(right_wall, distance, 0.5)(cv::Rect(320, 0, 320, 480))
      .copyTo(depth(cv::Rect(320, 0, 320, 480)));
  const auto cloud = organised_cloud(frame_of(depth), camera());
  const auto left = normal_errors(*cloud, -left_wall, 150, 158);
  const auto right = normal_errors(*cloud, -right_wall, 162, 170);
  EXPECT_LT(left.p95, 7.0);
  EXPECT_LT(right.p95, 7.0);
  EXPECT_GT((*cloud)(160, 120).curvature, 0.5F);
  EXPECT_LT((*cloud)(60, 120).curvature, 0.3F);
}

TEST(KeyframeCloud, DegenerateDepth) {
  const auto blank = organised_cloud(frame_of(cv::Mat(480, 640, CV_32FC1, cv::Scalar(0))), camera());
  EXPECT_EQ(worlds::finite_points(*blank), 0U);

  cv::Mat lonely(480, 640, CV_32FC1, cv::Scalar(0));
  lonely.at<float>(100, 100) = 1.0F;
  const auto one = organised_cloud(frame_of(lonely), camera());
  EXPECT_EQ(worlds::finite_points(*one), 1U);
  EXPECT_TRUE(std::isnan((*one)(50, 50).normal_x));

  const sensor::Pinhole tiny{5, 3, 5.0, 5.0, 2.0, 1.0};
  for (int stride : {1, 2, 7, 16}) {
    KeyframeCloudOptions options;
    options.stride_px = stride;
    const auto cloud = organised_cloud(frame_of(cv::Mat(3, 5, CV_32FC1, cv::Scalar(1))), tiny, options);
    EXPECT_EQ(cloud->width, static_cast<unsigned>((5 + stride - 1) / stride));
    EXPECT_EQ(worlds::finite_points(*cloud), cloud->size());
  }
  EXPECT_THROW(organised_cloud(frame_of(cv::Mat(3, 5, CV_32FC1, cv::Scalar(1))), camera()),
               std::invalid_argument);
  EXPECT_THROW(organised_cloud(frame_of(cv::Mat(480, 640, CV_16UC1, cv::Scalar(1))), camera()),
               std::invalid_argument);
}

TEST(KeyframeCloud, WithoutColourThePointsAreWhite) {
  auto frame = frame_of(plane_depth({0, 0, 1}, 1.0, 0.0));
  frame.color.release();
  EXPECT_EQ((*organised_cloud(frame, camera()))(5, 5).g, 255);
}

}  // namespace
}  // namespace plumbline::cloud
