// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "plumbline/sensor/recalibration.hpp"

namespace plumbline::sensor {
namespace {

const Pinhole kImage{640, 480, 520.0, 518.0, 318.0, 243.0};

Camera kinect() {
  Camera camera;
  camera.color = {640, 480, 526.0, 524.0, 316.0, 246.0};
  camera.distortion = {0.2, -0.5, 0.001, -0.002, 0.3};
  camera.depth_slope = {0.02, -0.01};
  return camera;
}

TEST(ImageModel, GoesToTheLensAndBack) {
  const ImageModel model(kImage, kinect());
  for (double u = 0.0; u < 640.0; u += 53.0) {
    for (double v = 0.0; v < 480.0; v += 47.0) {
      const Eigen::Vector2d back = model.rectified_pixel(model.lens_pixel({u, v}));
      EXPECT_NEAR(back.x(), u, 1e-6);
      EXPECT_NEAR(back.y(), v, 1e-6);
      EXPECT_NEAR(model.true_depth({u, v}, model.measured_depth({u, v}, 2.5)), 2.5, 1e-12);
    }
  }
}

TEST(ImageModel, OfThePinholeItselfChangesNothing) {
  Camera camera;
  camera.color = kImage;
  const ImageModel model(kImage, camera);
  EXPECT_EQ(model.lens_pixel({12.0, 400.0}), Eigen::Vector2d(12.0, 400.0));
  EXPECT_EQ(model.rectified_pixel({12.0, 400.0}), Eigen::Vector2d(12.0, 400.0));
  EXPECT_EQ(model.measured_depth({12.0, 400.0}, 3.0), 3.0);
}

TEST(Recalibration, ItsTableIsWhatTheModelsSay) {
  Camera before;
  before.color = kImage;
  const Recalibration change(kImage, before, kinect());
  for (double u = 3.0; u < 640.0; u += 31.7) {
    for (double v = 1.0; v < 480.0; v += 29.3) {
      const Eigen::Vector2d exact = change.after().rectified_pixel(change.before().lens_pixel({u, v}));
      EXPECT_LT((change.pixel({u, v}) - exact).norm(), 4e-3) << u << " " << v;
    }
  }
}

// What a plane's points become lies on a plane with the normal that is told, where the lens stays as it is.
TEST(Recalibration, ASlopeTiltsPlanesAndTheirNormals) {
  Camera before;
  before.color = kImage;
  Camera after = before;
  after.depth_slope = {0.03, -0.02};
  const Recalibration change(kImage, before, after);
  const Eigen::Vector3d normal = Eigen::Vector3d(0.2, -0.1, -1.0).normalized();
  const auto on_plane = [&](double x, double y) {
    const Eigen::Vector3d ray(x, y, 1.0);
    return Eigen::Vector3d(-2.0 / normal.dot(ray) * ray);
  };
  const Eigen::Vector3d p = on_plane(0.1, 0.2);
  const Eigen::Vector3d tilted = change.normal(p, normal);
  EXPECT_GT(tilted.dot(normal), 0.9);
  EXPECT_LT(tilted.dot(normal), 0.9999);
  for (const Eigen::Vector3d& q : {on_plane(-0.3, 0.1), on_plane(0.4, -0.3), on_plane(0.0, 0.0)})
    EXPECT_NEAR(tilted.dot(change.point(q) - change.point(p)), 0.0, 1e-9);
}

TEST(Recalibration, WithoutAChangeEverythingStays) {
  const Recalibration change(kImage, kinect(), kinect());
  EXPECT_TRUE(change.keeps_images());
  EXPECT_EQ(change.pixel({100.0, 50.0}), Eigen::Vector2d(100.0, 50.0));
  EXPECT_EQ(change.point({0.1, 0.2, 3.0}), Eigen::Vector3d(0.1, 0.2, 3.0));
  EXPECT_EQ(change.delay_s(), 0.0);
}

// A depth camera of its own measures places in space: the lens of the other one does not move them.
TEST(Recalibration, ADepthCameraOfItsOwnKeepsItsPlaces) {
  Camera before;
  before.color = kImage;
  before.depth = kImage;
  before.color_from_depth = geometry::Rigid3();
  Camera after = before;
  after.color.fx *= 1.02;
  const Recalibration change(kImage, before, after);
  EXPECT_EQ(change.point({0.4, 0.2, 2.0}), Eigen::Vector3d(0.4, 0.2, 2.0));
  EXPECT_NE(change.pixel({500.0, 50.0}).x(), 500.0);
}

}  // namespace
}  // namespace plumbline::sensor
