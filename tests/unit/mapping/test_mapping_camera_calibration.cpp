// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "plumbline/mapping/camera_calibration.hpp"
#include "plumbline/sensor/depth_noise.hpp"

namespace plumbline::mapping {
namespace {

using geometry::Rigid3;
using geometry::Vector6d;

struct World {
  maps::Map map;
  std::vector<maps::FramePose> frames;
};

sensor::Camera given_camera() {
  sensor::Camera camera;
  camera.color = {640, 480, 525.0, 525.0, 319.5, 239.5};
  return camera;
}

/// A camera that swings about before a cloud of corners, a keyframe every 0.1 s; `truth` has no distortion.
World swing(const sensor::Camera& truth, int keyframes, int corners) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::normal_distribution<double> normal;
  const auto pose_at = [](double t) {
    Vector6d xi;
    xi << 0.4 * std::sin(1.1 * t), 0.2 * std::sin(1.7 * t), 0.3 * std::sin(0.8 * t), 0.15 * std::sin(2.3 * t),
        0.35 * std::sin(1.4 * t), 0.2 * std::sin(1.9 * t);
    return geometry::exp_se3(xi);
  };
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < corners; ++i) {
    points.emplace_back(1.6 * uniform(random), 1.2 * uniform(random), 2.4 + 0.9 * uniform(random));
  }
  World world;
  std::vector<std::vector<std::pair<int, int>>> seen_as(points.size());  // keyframe, feature
  std::vector<core::KeyframeId> ids;
  for (int k = 0; k < keyframes; ++k) {
    const double stamp = 0.1 * k;
    auto features = std::make_shared<features::FrameFeatures>();
    for (std::size_t i = 0; i < points.size(); ++i) {
      double row = 0.5;
      Eigen::Vector3d p;
      for (int again = 0; again < 8; ++again) {
        p = pose_at(stamp + truth.readout_s.value_or(0.0) * (row - 0.5)) * points[i];
        row = truth.color.project(p).y() / truth.color.height;
      }
      const Eigen::Vector2d pixel = truth.color.project(p);
      if (p.z() < 0.5 || !truth.color.contains(pixel, 2.0)) continue;
      features::PointFeature f;
      f.pixel = (pixel + 0.4 * Eigen::Vector2d(normal(random), normal(random))).cast<float>();
      const double tilt = (truth.depth_slope[0] * p.x() + truth.depth_slope[1] * p.y()) / p.z();
      f.depth =
          static_cast<float>(p.z() / (1.0 - p.z() * tilt) + sensor::depth_sigma(p.z()) * normal(random));
      // The surface is level in the world: what the same ray meets when the depth image is taken.
      const Rigid3 later = pose_at(stamp + truth.readout_s.value_or(0.0) * (row - 0.5) + truth.depth_delay_s);
      const Eigen::Vector3d facing = later.rotation.col(2);
      f.depth += static_cast<float>(facing.dot(later * points[i]) / facing.dot(p / p.z()) - p.z());
      seen_as[i].emplace_back(k, static_cast<int>(features->points.size()));
      features->points.push_back(f);
      features->descriptors.emplace_back();
    }
    auto keyframe = std::make_shared<maps::Keyframe>();
    keyframe->id = world.map.next_keyframe_id(0);
    keyframe->stamp = stamp;
    keyframe->features = features;
    ids.push_back(world.map.add_keyframe(keyframe, pose_at(stamp)));
    world.map.attach(ids.back());
    for (const double beside : {-0.03, 0.0, 0.03}) {
      world.frames.push_back(
          {stamp + beside, ids.back(), pose_at(stamp + beside) * pose_at(stamp).inverse(), true, {}, 0.0});
    }
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (seen_as[i].empty()) continue;
    maps::MapPoint point;
    point.position = points[i];
    point.normal = -Eigen::Vector3d::UnitZ();
    const core::PointId id = world.map.add_point(0, point);
    for (const auto& [k, feature] : seen_as[i])
      world.map.observe(id, ids[static_cast<std::size_t>(k)], feature);
  }
  return world;
}

core::Result<CameraCalibration> calibrate(const World& world, int threads = 1,
                                          const CalibrationOptions& options = {}) {
  const core::Executor executor(threads);
  return calibrate_camera({{&world.map, &world.frames, given_camera().color}}, given_camera(), options,
                          executor);
}

const CameraFinding& finding(const CameraCalibration& calibration, const std::string& name) {
  for (const CameraFinding& f : calibration.findings) {
    if (f.name == name) return f;
  }
  throw std::out_of_range(name);
}

TEST(CalibrateCamera, FindsReadoutSlopeAndFocalLength) {
  sensor::Camera truth = given_camera();
  truth.readout_s = 0.02;
  truth.depth_slope = {0.02, 0.0};
  truth.color.fx *= 1.02;
  truth.color.fy *= 1.02;
  const auto found = calibrate(swing(truth, 80, 150));
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_TRUE(finding(*found, "readout").used);
  EXPECT_TRUE(finding(*found, "depth_slope x").used);
  EXPECT_TRUE(finding(*found, "fx").used);
  EXPECT_NEAR(*found->camera.readout_s, 0.02, 0.002);
  EXPECT_NEAR(found->camera.depth_slope[0], 0.02, 0.003);
  EXPECT_NEAR(found->camera.color.fx, truth.color.fx, 2.5);
  EXPECT_NEAR(found->camera.color.fy, truth.color.fy, 2.5);
  EXPECT_GT(found->gain, 0.2);
  EXPECT_NEAR(found->camera.color.cx, 319.5, 1.0);
  EXPECT_GT(finding(*found, "fx").wrong, 0.9);
  EXPECT_LT(finding(*found, "cx").wrong, 0.3);
}

TEST(CalibrateCamera, FindsThatDepthCameLate) {
  sensor::Camera truth = given_camera();
  truth.depth_delay_s = 0.02;
  const auto found = calibrate(swing(truth, 40, 150));
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_TRUE(finding(*found, "depth_delay").used);
  EXPECT_NEAR(found->camera.depth_delay_s, 0.02, 0.006);
  for (const CameraFinding& f : found->findings) {
    if (f.name == "depth_delay") continue;
    EXPECT_LT(f.wrong, 0.3) << f.name << " " << f.found << " +- " << f.sigma;
  }
}

TEST(CalibrateCamera, LeavesACameraThatFitsAlone) {
  const auto found = calibrate(swing(given_camera(), 20, 90));
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_LT(found->news, 2.0);
  for (const CameraFinding& f : found->findings) {
    EXPECT_LT(f.wrong, 0.3) << f.name << " " << f.found << " +- " << f.sigma;
    EXPECT_LT(std::abs(f.found - f.given), 2.0 * f.sigma) << f.name << " " << f.found;
  }
}

// A map that was made with a better camera is asked about the file all the same: what was found before is no
// evidence of its own.
TEST(CalibrateCamera, EveryQuestionStartsFromTheFile) {
  const World world = swing(given_camera(), 80, 150);
  CalibrationOptions options;
  options.file = given_camera();
  options.file->color.fx *= 1.02;
  options.file->color.fy *= 1.02;
  options.file->readout_s = 0.02;
  const auto found = calibrate(world, 1, options);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_EQ(finding(*found, "fx").given, options.file->color.fx);
  EXPECT_GT(finding(*found, "fx").wrong, 0.9);
  EXPECT_GT(finding(*found, "readout").wrong, 0.9);
  EXPECT_NEAR(found->camera.color.fx, given_camera().color.fx, 2.0);
  EXPECT_NEAR(*found->camera.readout_s, 0.0, 0.002);
}

TEST(CalibrateCamera, SameForAnyNumberOfThreads) {
  sensor::Camera truth = given_camera();
  truth.readout_s = 0.015;
  const World world = swing(truth, 12, 60);
  const auto one = calibrate(world, 1);
  const auto three = calibrate(world, 3);
  ASSERT_TRUE(one && three);
  EXPECT_EQ(sensor::to_yaml(one->camera), sensor::to_yaml(three->camera));
  ASSERT_EQ(one->findings.size(), three->findings.size());
  for (std::size_t i = 0; i < one->findings.size(); ++i) {
    EXPECT_EQ(one->findings[i].found, three->findings[i].found);
    EXPECT_EQ(one->findings[i].sigma, three->findings[i].sigma);
  }
}

TEST(CalibrateCamera, TooLittleIsAnError) {
  for (const auto& [keyframes, corners] : {std::pair{3, 90}, std::pair{20, 3}, std::pair{0, 0}}) {
    const auto found = calibrate(swing(given_camera(), keyframes, corners));
    ASSERT_FALSE(found) << keyframes << " keyframes, " << corners << " corners";
    EXPECT_EQ(found.error().kind, core::ErrorKind::kInput);
    EXPECT_THAT(found.error().message, testing::HasSubstr("film a place"));
  }
}

}  // namespace
}  // namespace plumbline::mapping
