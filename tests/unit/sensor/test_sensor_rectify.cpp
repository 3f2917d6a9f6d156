// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <stdexcept>
#include <vector>

#include "plumbline/sensor/rectify.hpp"

namespace plumbline::sensor {
namespace {

Camera small_camera() {
  Camera camera;
  camera.color = {64, 48, 52.5, 52.5, 31.5, 23.5};
  return camera;
}

/// The projection of a plane through `point` with `normal`, as raw depth of `pinhole`.
cv::Mat plane_raw(const Pinhole& pinhole, const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
                  double depth_scale) {
  cv::Mat raw(pinhole.height, pinhole.width, CV_16UC1);
  for (int v = 0; v < raw.rows; ++v) {
    for (int u = 0; u < raw.cols; ++u) {
      const double z = normal.dot(point) / normal.dot(pinhole.unproject(u, v, 1.0));
      raw.at<std::uint16_t>(v, u) = static_cast<std::uint16_t>(std::lround(z * depth_scale));
    }
  }
  return raw;
}

TEST(Rectifier, WithoutDistortionOnlyUnitsChange) {
  const Camera camera = small_camera();
  const Rectifier rectifier(camera);
  cv::Mat raw(48, 64, CV_16UC1, cv::Scalar(5000));
  raw.at<std::uint16_t>(0, 0) = 0;
  raw.at<std::uint16_t>(1, 1) = 65535;
  raw.at<std::uint16_t>(2, 2) = 65534;
  const cv::Mat depth = rectifier.depth(raw);
  ASSERT_EQ(depth.type(), CV_32FC1);
  EXPECT_EQ(depth.at<float>(0, 0), 0.0F);
  EXPECT_EQ(depth.at<float>(1, 1), 0.0F);
  EXPECT_FLOAT_EQ(depth.at<float>(2, 2), 65534.0F / 5000.0F);
  EXPECT_EQ(depth.at<float>(5, 5), 1.0F);
  const cv::Mat color(48, 64, CV_8UC3, cv::Scalar(1, 2, 3));
  EXPECT_EQ(cv::norm(rectifier.color(color), color, cv::NORM_INF), 0.0);
}

TEST(Rectifier, DepthSlopeIsTakenOut) {
  Camera camera = small_camera();
  camera.depth_slope = {0.1, -0.05};
  const cv::Mat raw(48, 64, CV_16UC1, cv::Scalar(10000));
  const cv::Mat depth = Rectifier(camera).depth(raw);
  for (const auto& [u, v] : {std::pair{0, 0}, std::pair{63, 5}, std::pair{31, 47}}) {
    const Eigen::Vector3d ray = camera.color.unproject(u, v, 1.0);
    EXPECT_NEAR(1.0 / static_cast<double>(depth.at<float>(v, u)), 0.5 + 0.1 * ray.x() - 0.05 * ray.y(), 1e-6);
  }
  cv::Mat holes = raw.clone();
  holes.at<std::uint16_t>(3, 4) = 0;
  EXPECT_EQ(Rectifier(camera).depth(holes).at<float>(3, 4), 0.0F);
}

// A smooth picture whose value is the raw x coordinate: after undistortion, a pixel's value must be the
// x coordinate that OpenCV's own inverse (undistortPoints) maps back to that pixel.
TEST(Rectifier, AgreesWithUndistortPoints) {
  Camera camera = small_camera();
  camera.distortion = {0.2624, -0.9531, -0.0054, 0.0026, 1.1633};
  const Rectifier rectifier(camera);
  cv::Mat raw(48, 64, CV_8UC1);
  cv::Mat raw_depth(48, 64, CV_16UC1);
  for (int v = 0; v < 48; ++v) {
    for (int u = 0; u < 64; ++u) {
      raw.at<std::uint8_t>(v, u) = static_cast<std::uint8_t>(4 * u);
      raw_depth.at<std::uint16_t>(v, u) = static_cast<std::uint16_t>(1 + v * 64 + u);
    }
  }
  const cv::Mat color = rectifier.color(raw);
  const cv::Mat depth = rectifier.depth(raw_depth);
  const Pinhole& p = camera.color;
  const cv::Matx33d k(p.fx, 0, p.cx, 0, p.fy, p.cy, 0, 0, 1);
  const cv::Mat distortion(1, 5, CV_64F, camera.distortion.data());

  double largest_shift = 0.0;
  int checked = 0;
  for (int v = 4; v < 44; v += 4) {
    for (int u = 4; u < 60; u += 4) {
      const std::vector<cv::Point2d> source = {cv::Point2d(u, v)};
      std::vector<cv::Point2d> target;
      cv::undistortPoints(source, target, k, distortion, cv::noArray(), k);
      const int tu = cvRound(target[0].x);
      const int tv = cvRound(target[0].y);
      ASSERT_TRUE(tu >= 0 && tv >= 0 && tu < 64 && tv < 48);
      // moving by the rounding error in the target moves the source by nearly as much
      const double expected = u + (tu - target[0].x);
      EXPECT_NEAR(color.at<std::uint8_t>(tv, tu) / 4.0, expected, 0.4) << u << ' ' << v;
      const int index = cvRound(depth.at<float>(tv, tu) * 5000.0F) - 1;
      ASSERT_GE(index, 0);
      EXPECT_NEAR(index % 64, u, 1.01);
      EXPECT_NEAR(index / 64, v, 1.01);
      largest_shift = std::max(largest_shift, std::hypot(target[0].x - u, target[0].y - v));
      ++checked;
    }
  }
  EXPECT_GT(checked, 100);
  EXPECT_GT(largest_shift, 0.5);  // the lens does bend here, so the comparison says something
}

TEST(Rectifier, DepthIsNeverMixedAcrossABorder) {
  Camera camera = small_camera();
  camera.distortion = {0.2, -0.3, 0.0, 0.0, 0.0};
  cv::Mat raw(48, 64, CV_16UC1, cv::Scalar(5000));
  raw.colRange(32, 64).setTo(20000);
  const cv::Mat depth = Rectifier(camera).depth(raw);
  for (int v = 0; v < depth.rows; ++v) {
    for (int u = 0; u < depth.cols; ++u) {
      const float z = depth.at<float>(v, u);
      EXPECT_TRUE(z == 0.0F || z == 1.0F || z == 4.0F) << z;
    }
  }
}

/// Depth camera of `width` columns beside the colour camera, seeing a slanted plane.
void check_registered_plane(int width, double tolerance_m) {
  Camera camera = small_camera();
  const double ratio = width / 64.0;
  camera.depth = Pinhole{width,
                         static_cast<int>(48 * ratio),
                         40.0 * ratio,
                         40.0 * ratio,
                         (width - 1) / 2.0,
                         (48 * ratio - 1) / 2.0};
  camera.color_from_depth = geometry::Rigid3(geometry::exp_so3({0.01, -0.02, 0.005}), {0.05, -0.01, 0.004});
  const Eigen::Vector3d point(0, 0, 2);
  const Eigen::Vector3d normal = Eigen::Vector3d(0.3, 0.1, -1).normalized();
  const cv::Mat depth = Rectifier(camera).depth(plane_raw(*camera.depth, point, normal, camera.depth_scale));
  ASSERT_EQ(depth.size(), cv::Size(64, 48));
  const Eigen::Vector3d point_c = *camera.color_from_depth * point;
  const Eigen::Vector3d normal_c = camera.color_from_depth->rotation * normal;
  for (int v = 4; v < 44; ++v) {
    for (int u = 4; u < 60; ++u) {
      const double truth = normal_c.dot(point_c) / normal_c.dot(camera.color.unproject(u, v, 1.0));
      ASSERT_NEAR(depth.at<float>(v, u), truth, tolerance_m)
          << "no hole and the right depth at " << u << ' ' << v;
    }
  }
}

TEST(Rectifier, RegistersAPlaneAtTheSameResolution) { check_registered_plane(64, 0.025); }
TEST(Rectifier, RegistersAPlaneFromAQuarterOfThePixels) { check_registered_plane(32, 0.04); }
TEST(Rectifier, RegistersAPlaneFromFourTimesThePixels) { check_registered_plane(128, 0.02); }

TEST(Rectifier, TheNearestSurfaceWins) {
  Camera camera = small_camera();
  camera.depth = camera.color;
  camera.color_from_depth = geometry::Rigid3(Eigen::Matrix3d::Identity(), {0.1, 0, 0});
  cv::Mat raw(48, 64, CV_16UC1, cv::Scalar(20000));
  raw.colRange(20, 30).setTo(5000);  // a post at 1 m in front of a wall at 4 m
  const cv::Mat depth = Rectifier(camera).depth(raw);
  // the post moves by fx * 0.1 / 1 = 5.25 px, the wall by 1.3 px: the post hides the wall
  for (int u = 26; u <= 34; ++u) EXPECT_EQ(depth.at<float>(24, u), 1.0F) << u;
  EXPECT_EQ(depth.at<float>(24, 40), 4.0F);
  EXPECT_EQ(depth.at<float>(24, 10), 4.0F);
  EXPECT_EQ(depth.at<float>(24, 23), 0.0F);  // the post's shadow: nothing was seen there
}

TEST(Rectifier, NoDepthBehindOrBesideTheCamera) {
  Camera camera = small_camera();
  camera.depth = camera.color;
  camera.color_from_depth = geometry::Rigid3(Eigen::Matrix3d::Identity(), {0, 0, -2});
  EXPECT_EQ(cv::countNonZero(Rectifier(camera).depth(cv::Mat(48, 64, CV_16UC1, cv::Scalar(5000)))), 0);
  camera.color_from_depth = geometry::Rigid3(Eigen::Matrix3d::Identity(), {1e6, 0, 0});
  EXPECT_EQ(cv::countNonZero(Rectifier(camera).depth(cv::Mat(48, 64, CV_16UC1, cv::Scalar(5000)))), 0);
  EXPECT_EQ(cv::countNonZero(Rectifier(camera).depth(cv::Mat(48, 64, CV_16UC1, cv::Scalar(0)))), 0);
}

TEST(Rectifier, RefusesOtherImages) {
  const Rectifier rectifier(small_camera());
  EXPECT_THROW((void)rectifier.depth(cv::Mat(48, 64, CV_8UC1)), std::invalid_argument);
  EXPECT_THROW((void)rectifier.depth(cv::Mat(47, 64, CV_16UC1)), std::invalid_argument);
  EXPECT_THROW((void)rectifier.color(cv::Mat(48, 63, CV_8UC3)), std::invalid_argument);
}

}  // namespace
}  // namespace plumbline::sensor
