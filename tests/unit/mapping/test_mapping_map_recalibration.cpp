// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "landmark_world.hpp"
#include "plumbline/mapping/adjustment/map_recalibration.hpp"

namespace plumbline::mapping {
namespace {

using geometry::Rigid3;
using tests::LandmarkWorld;

/// Five keyframes of a camera that moves along a wall and towards it, and the frames that became them.
struct FilmedWall {
  LandmarkWorld world{7, 60, 8};
  std::vector<maps::FramePose> frames;
  std::vector<core::KeyframeId> keyframes;

  FilmedWall() {
    world.add_wall(3.6, 2.5);
    for (int i = 0; i < 5; ++i) {
      const Rigid3 turn(
          Eigen::AngleAxisd(0.03 * (i - 2), Eigen::Vector3d(0.3, 1.0, 0.1).normalized()).toRotationMatrix(),
          Eigen::Vector3d::Zero());
      const core::KeyframeId id = world.add_keyframe(
          turn * Rigid3(Eigen::Matrix3d::Identity(), Eigen::Vector3d(-0.1 * (i - 2), 0.0, -0.1 * (i - 2))));
      auto keyframe = std::make_shared<maps::Keyframe>(world.map.keyframe(id));
      keyframe->stamp = 0.1 * i;
      if (i > 0) {
        keyframe->reference = keyframes.back();
        keyframe->camera_from_reference =
            world.map.camera_from_world(id) * world.map.camera_from_world(keyframes.back()).inverse();
        keyframe->reference_sigma_m = 0.002;
      }
      world.map.replace_keyframe(keyframe);
      keyframes.push_back(id);
      maps::FramePose frame;
      frame.stamp = keyframe->stamp;
      frame.reference = id;
      frame.tracked = true;
      frames.push_back(frame);
    }
    for (std::size_t i = 0; i < world.points.size(); ++i) world.add_point(i, keyframes);
    for (std::size_t i = 0; i < world.lines.size(); ++i) world.add_line(i, keyframes);
  }

  [[nodiscard]] sensor::Camera given() const {
    sensor::Camera camera;
    camera.color = world.camera;
    return camera;
  }
  void change(const sensor::Camera& before, const sensor::Camera& after) {
    recalibrate_map(sensor::Recalibration(world.camera, before, after), world.map, frames);
  }
  /// Largest distance of a landmark from where it is, metres.
  [[nodiscard]] double landmarks_off() const {
    double most = 0.0;
    for (const core::PointId id : world.map.point_ids()) {
      const auto i = static_cast<std::size_t>(id.index);
      most = std::max(most, (world.map.point(id).position - world.points[i]).norm());
    }
    for (const core::LineId id : world.map.line_ids()) {
      const auto i = static_cast<std::size_t>(id.index);
      most = std::max(most, (world.map.line(id).end - world.lines[i].second).norm());
    }
    return most;
  }
  /// Largest distance of a point feature from where the keyframe at `pose` sees its point, pixels.
  [[nodiscard]] double features_off(const std::vector<Rigid3>& poses) const {
    double most = 0.0;
    for (std::size_t k = 0; k < keyframes.size(); ++k) {
      const auto& features = world.map.keyframe(keyframes[k]).features->points;
      for (std::size_t i = 0; i < features.size(); ++i) {
        const Eigen::Vector2d seen = world.camera.project(poses[k] * world.points[i]);
        most = std::max(most, (features[i].pixel.cast<double>() - seen).norm());
      }
    }
    return most;
  }
  [[nodiscard]] std::vector<Rigid3> poses() const {
    std::vector<Rigid3> all;
    for (const core::KeyframeId id : keyframes) all.push_back(world.map.camera_from_world(id));
    return all;
  }
};

double largest_difference(const std::vector<Rigid3>& a, const std::vector<Rigid3>& b) {
  double most = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i)
    most = std::max(most, geometry::log_se3(a[i] * b[i].inverse()).cwiseAbs().maxCoeff());
  return most;
}

TEST(MapRecalibration, TheSameCameraChangesNothing) {
  FilmedWall wall;
  const std::vector<Rigid3> poses = wall.poses();
  wall.change(wall.given(), wall.given());
  EXPECT_LT(wall.landmarks_off(), 1e-6);
  EXPECT_LT(wall.features_off(poses), 1e-3);
  EXPECT_LT(largest_difference(wall.poses(), poses), 1e-6);
}

// A map is made with the wrong camera out of the right one, and found to be right again.
TEST(MapRecalibration, AMapOfTheWrongCameraBecomesThatOfTheRightOne) {
  FilmedWall wall;
  const std::vector<Rigid3> poses = wall.poses();
  sensor::Camera wrong = wall.given();
  wrong.color.fx *= 1.02;
  wrong.color.fy *= 1.02;
  wrong.distortion = {0.03, -0.05, 0.0, 0.0, 0.0};
  wrong.depth_slope = {0.01, 0.0};

  wall.change(wall.given(), wrong);
  EXPECT_GT(wall.landmarks_off(), 0.02);
  EXPECT_GT(wall.features_off(poses), 2.0);

  wall.change(wrong, wall.given());
  EXPECT_LT(wall.landmarks_off(), 0.002);
  EXPECT_LT(wall.features_off(poses), 0.05);
  EXPECT_LT(largest_difference(wall.poses(), poses), 0.002);
}

// A depth image that was taken later than was believed shows the wall nearer than the colour image's camera
// had it.
TEST(MapRecalibration, ADelayOfDepthMovesSurfacesAlongTheirRays) {
  FilmedWall wall;
  sensor::Camera late = wall.given();
  late.depth_delay_s = 0.02;
  const core::KeyframeId middle = wall.keyframes[2];
  const std::vector<maps::SurfaceSample> before = wall.world.map.keyframe(middle).surface;
  wall.change(wall.given(), late);
  const std::vector<maps::SurfaceSample>& after = wall.world.map.keyframe(middle).surface;
  ASSERT_EQ(before.size(), after.size());
  double sum = 0.0;
  for (std::size_t i = 0; i < before.size(); ++i)
    sum += static_cast<double>(after[i].point.z() - before[i].point.z());
  // 1 m/s towards the wall for 20 ms; what it measured was nearer than the wall at the colour image.
  EXPECT_NEAR(sum / static_cast<double>(before.size()), 0.02, 0.004);
}

}  // namespace
}  // namespace plumbline::mapping
