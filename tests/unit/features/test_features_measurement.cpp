// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "plumbline/features/measurement.hpp"
#include "plumbline/features/rolling_shutter.hpp"

namespace plumbline::features {
namespace {

using geometry::Vector6d;

const sensor::Pinhole kImage{640, 480, 520.0, 518.0, 318.0, 243.0};

sensor::Camera given() {
  sensor::Camera camera;
  camera.color = kImage;
  return camera;
}

Vector6d swing() {
  Vector6d velocity;
  velocity << 0.2, -0.1, 0.3, 0.5, -0.8, 0.4;
  return velocity;
}

FrameFeatures some_features() {
  FrameFeatures features;
  for (int i = 0; i < 20; ++i) {
    PointFeature point;
    point.pixel =
        Eigen::Vector2f(30.0F + 30.0F * static_cast<float>(i), 20.0F + 22.0F * static_cast<float>(i));
    point.depth = i % 4 == 0 ? 0.0F : 1.0F + 0.1F * static_cast<float>(i);
    features.points.push_back(point);
  }
  LineFeature line;
  line.segment.start = {100.0F, 60.0F};
  line.segment.end = {400.0F, 420.0F};
  line.line3.emplace();
  line.line3->start = kImage.unproject(100.0, 60.0, 2.0);
  line.line3->end = kImage.unproject(400.0, 420.0, 2.5);
  features.lines.push_back(line);
  features.grid = PointGrid(features.points, kImage.width, kImage.height);
  return features;
}

TEST(Measurement, GoesToTheLensAndBack) {
  sensor::Camera camera = given();
  camera.distortion = {0.2, -0.5, 0.001, -0.002, 0.3};
  camera.depth_slope = {0.02, 0.01};
  const sensor::ImageModel model(kImage, camera);
  const Vector6d motion = 0.02 * swing();
  for (const double depth : {0.0, 1.5, 4.0}) {
    const PixelDepth feature{{500.0, 90.0}, depth};
    const PixelDepth back = feature_of(measurement_of(feature, motion, model), motion, model);
    EXPECT_LT((back.pixel - feature.pixel).norm(), 1e-3);
    EXPECT_NEAR(back.depth, depth, 1e-6);
  }
}

// Features that were made with the one camera and changed are those that the other one makes.
TEST(Measurement, ChangedFeaturesAreThoseOfTheOtherCamera) {
  sensor::Camera truth = given();
  truth.readout_s = 0.02;
  const FrameFeatures raw = some_features();
  FrameFeatures expected = raw;
  undo_rolling_shutter(expected, kImage, swing(), 0.02);

  FrameFeatures wrong = raw;
  undo_rolling_shutter(wrong, kImage, swing(), 0.007);
  sensor::Camera before = given();
  before.readout_s = 0.007;
  recalibrate(wrong, sensor::Recalibration(kImage, before, truth), swing(), {});
  for (std::size_t i = 0; i < raw.points.size(); ++i) {
    EXPECT_LT((wrong.points[i].pixel - expected.points[i].pixel).norm(), 0.01F) << i;
    EXPECT_NEAR(wrong.points[i].depth, expected.points[i].depth, 1e-3F) << i;
  }
  EXPECT_LT((wrong.lines[0].segment.end - expected.lines[0].segment.end).norm(), 0.01F);
  EXPECT_LT((wrong.lines[0].line3->end - expected.lines[0].line3->end).norm(), 1e-3);
  EXPECT_LT((wrong.shutter_motion - expected.shutter_motion).norm(), 1e-12);
}

TEST(Measurement, ALongerDelayMovesDepthByItsRate) {
  sensor::Camera late = given();
  late.depth_delay_s = 0.02;
  FrameFeatures features = some_features();
  const FrameFeatures before = features;
  recalibrate(features, sensor::Recalibration(kImage, given(), late), swing(),
              std::vector<double>(features.points.size(), 0.5));
  for (std::size_t i = 0; i < features.points.size(); ++i) {
    const float expected = before.points[i].depth > 0.0F ? before.points[i].depth - 0.01F : 0.0F;
    EXPECT_NEAR(features.points[i].depth, expected, 1e-5F);
  }
}

}  // namespace
}  // namespace plumbline::features
