// SPDX-License-Identifier: BSD-3-Clause
// Lens models against OpenCV's own projection.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <vector>

#include "plumbline/sensor/lens.hpp"
#include "plumbline/sensor/recalibration.hpp"
#include "plumbline/sensor/rectify.hpp"

namespace plumbline::sensor {
namespace {

/// An Azure Kinect's colour and depth camera, a wide fisheye, a Kinect.
std::vector<Lens> lenses() {
  return {{LensModel::kRadialTangential, {0.33, -2.489, -0.00016, -0.00013, 1.4537, 0.2089, -2.3029, 1.3751}},
          {LensModel::kRadialTangential, {6.084, 4.375, -5.5e-5, 6.5e-5, 0.2362, 6.409, 6.418, 1.2202}},
          {LensModel::kEquidistant, {-0.013, 0.002, -0.001, 0.0003}},
          {LensModel::kRadialTangential, {0.2624, -0.9531, -0.0054, 0.0026, 1.1633}}};
}

Eigen::Vector2d by_opencv(const Lens& lens, const Eigen::Vector2d& ray) {
  const cv::Matx33d eye = cv::Matx33d::eye();
  std::vector<cv::Point2d> out;
  if (lens.model == LensModel::kEquidistant) {
    const std::vector<double> k(lens.k.begin(), lens.k.begin() + 4);
    cv::fisheye::distortPoints(std::vector<cv::Point2d>{{ray.x(), ray.y()}}, out, eye, k);
  } else {
    const std::vector<double> k(lens.k.begin(), lens.k.end());
    cv::projectPoints(std::vector<cv::Point3d>{{ray.x(), ray.y(), 1.0}}, cv::Vec3d(), cv::Vec3d(), eye, k,
                      out);
  }
  return {out[0].x, out[0].y};
}

TEST(Lens, DistortsAsOpenCvDoes) {
  for (const Lens& lens : lenses()) {
    for (double x = -0.6; x <= 0.6; x += 0.15) {
      for (double y = -0.4; y <= 0.4; y += 0.1)
        EXPECT_LT((lens.distort({x, y}) - by_opencv(lens, {x, y})).norm(), 1e-12) << x << ' ' << y;
    }
  }
}

TEST(Lens, DerivativesAreThoseOfDifferences) {
  constexpr double kStep = 1e-6;
  for (const Lens& lens : lenses()) {
    for (const Eigen::Vector2d& ray : {Eigen::Vector2d(0.3, -0.2), {-0.5, 0.1}, {0.02, 0.4}}) {
      Eigen::Matrix2d by_ray;
      for (int i = 0; i < 2; ++i) {
        const Eigen::Vector2d step = kStep * Eigen::Vector2d::Unit(i);
        by_ray.col(i) = (lens.distort(ray + step) - lens.distort(ray - step)) / (2.0 * kStep);
      }
      EXPECT_LT((lens.jacobian(ray) - by_ray).norm(), 1e-8);
      const auto by_k = [&](std::size_t i) -> Eigen::Vector2d {
        Lens more = lens;
        more.k[i] += kStep;
        return (more.distort(ray) - lens.distort(ray)) / kStep;
      };
      const Lens::ByCoefficients by = lens.by_coefficients(ray);
      EXPECT_LT((by_k(0) - by.by_k1 * ray).norm(), 1e-8);
      EXPECT_LT((by_k(1) - by.by_k1 * by.k2_by_k1 * ray).norm(), 1e-8);
    }
  }
}

TEST(Lens, RaysComeBack) {
  for (const Lens& lens : lenses()) {
    for (double x = -0.5; x <= 0.5; x += 0.1) {
      const Eigen::Vector2d ray(x, 0.3);
      const auto back = lens.ray_of(lens.distort(ray));
      ASSERT_TRUE(back) << x;
      EXPECT_LT((*back - ray).norm(), 1e-9) << x;
    }
  }
  const Lens fisheye{LensModel::kEquidistant, {}};
  const auto steep = fisheye.ray_of({1.5, 0.0});  // 86 degrees
  ASSERT_TRUE(steep);
  EXPECT_NEAR(steep->x(), std::tan(1.5), 1e-9);
  EXPECT_FALSE(fisheye.ray_of({1.6, 0.0})) << "behind the camera";
  EXPECT_TRUE(fisheye.ray_of({0.0, 0.0}));
  // its polynomial folds back at r = 0.58
  EXPECT_FALSE((Lens{LensModel::kRadialTangential, {-1.0, 0.0}}.ray_of({0.5, 0.0})));
}

Camera azure_like() {
  Camera camera;
  camera.color = {96, 72, 60.0, 60.0, 47.5, 35.5};
  camera.model = LensModel::kRadialTangential;
  camera.distortion = lenses()[0].k;
  camera.depth = Pinhole{80, 72, 63.0, 63.0, 39.5, 36.0};
  camera.depth_lens = lenses()[1];
  camera.color_from_depth =
      geometry::Rigid3(geometry::exp_so3({0.01, -0.02, 0.005}), {-0.032, -0.002, 0.004});
  camera.depth_scale = 1000.0;
  return camera;
}

// Depth of a slanted plane as a lens shows it: registered into the undistorted colour image it must be the
// plane there.
TEST(Rectifier, BothCamerasMayBeDistorted) {
  for (const Lens& lens : lenses()) {
    Camera camera = azure_like();
    camera.depth_lens = lens;
    const Eigen::Vector3d normal = Eigen::Vector3d(0.2, 0.1, -1.0).normalized();
    const Eigen::Vector3d point(0.0, 0.0, 2.0);
    cv::Mat raw(camera.depth->height, camera.depth->width, CV_16UC1, cv::Scalar(0));
    for (int v = 0; v < raw.rows; ++v) {
      for (int u = 0; u < raw.cols; ++u) {
        const auto ray = lens.ray_of(camera.depth->unproject(u, v, 1.0).head<2>());
        if (!ray) continue;
        const double z = normal.dot(point) / normal.dot(ray->homogeneous());
        raw.at<std::uint16_t>(v, u) = static_cast<std::uint16_t>(std::lround(1000.0 * z));
      }
    }
    const cv::Mat depth = Rectifier(camera).depth(raw);
    const Eigen::Vector3d point_c = *camera.color_from_depth * point;
    const Eigen::Vector3d normal_c = camera.color_from_depth->rotation * normal;
    for (int v = 20; v < 52; ++v) {
      for (int u = 28; u < 68; ++u) {
        const double truth = normal_c.dot(point_c) / normal_c.dot(camera.color.unproject(u, v, 1.0));
        ASSERT_NEAR(depth.at<float>(v, u), truth, 0.012) << u << ' ' << v;
      }
    }
  }
}

// A ramp as a fisheye shows it comes out as what OpenCV's own inverse says.
TEST(Rectifier, FisheyeAgreesWithUndistortPoints) {
  Camera camera;
  camera.color = {96, 72, 45.0, 45.0, 47.5, 35.5};
  camera.model = LensModel::kEquidistant;
  camera.distortion = lenses()[2].k;
  cv::Mat raw(72, 96, CV_8UC1);
  for (int u = 0; u < 96; ++u) raw.col(u).setTo(2 * u);
  const cv::Mat color = Rectifier(camera).color(raw);
  const Pinhole& p = camera.color;
  const cv::Matx33d k(p.fx, 0, p.cx, 0, p.fy, p.cy, 0, 0, 1);
  const std::vector<double> d(camera.distortion.begin(), camera.distortion.begin() + 4);
  double largest_shift = 0.0;
  for (int v = 20; v < 52; v += 4) {
    for (int u = 20; u < 76; u += 4) {
      std::vector<cv::Point2d> to;
      cv::fisheye::undistortPoints(std::vector<cv::Point2d>{cv::Point2d(u, v)}, to, k, d, cv::noArray(), k);
      const int tu = cvRound(to[0].x);
      const int tv = cvRound(to[0].y);
      if (tu < 2 || tv < 2 || tu > 93 || tv > 69) continue;
      EXPECT_NEAR(color.at<std::uint8_t>(tv, tu) / 2.0, u + (tu - to[0].x) * 0.8, 0.6) << u << ' ' << v;
      largest_shift = std::max(largest_shift, std::hypot(to[0].x - u, to[0].y - v));
    }
  }
  EXPECT_GT(largest_shift, 3.0);
}

TEST(ImageModel, PixelsComeBackWhateverTheLens) {
  for (const Lens& lens : lenses()) {
    Camera camera = azure_like();
    camera.model = lens.model;
    camera.distortion = lens.k;
    const ImageModel model({96, 72, 61.0, 60.5, 47.0, 35.0}, camera);
    for (int u = 10; u < 90; u += 8) {
      const Eigen::Vector2d pixel(u, 30.0);
      EXPECT_LT((model.rectified_pixel(model.lens_pixel(pixel)) - pixel).norm(), 1e-5) << u;
    }
  }
}

}  // namespace
}  // namespace plumbline::sensor
