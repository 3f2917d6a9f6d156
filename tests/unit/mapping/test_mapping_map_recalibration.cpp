// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "landmark_world.hpp"
#include "plumbline/mapping/adjustment/camera_shifts.hpp"
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

// Numbers that are wrong together move keyframes as the camera does that has both, and nothing else moves
// them.
TEST(MapRecalibration, ShiftsByTheCovarianceAreThoseOfTheOtherCamera) {
  FilmedWall wall;
  const std::vector<Rigid3> poses = wall.poses();
  constexpr double kLonger = 0.01, kRight_px = 3.0;
  optimize::CameraCovariance covariance = optimize::CameraCovariance::Zero();
  const auto shifts_now = [&] {
    return camera_shifts(wall.world.map, wall.frames, wall.world.camera, wall.given(), covariance,
                         core::Executor(2));
  };
  for (const KeyframeShift& shift : shifts_now()) {
    for (const geometry::Vector6d& motion : shift.motions) EXPECT_LT(motion.norm(), 1e-9);
  }

  covariance(optimize::kFocal, optimize::kFocal) = kLonger * kLonger;
  covariance(optimize::kCentreX, optimize::kCentreX) = kRight_px * kRight_px;
  covariance(optimize::kFocal, optimize::kCentreX) = covariance(optimize::kCentreX, optimize::kFocal) =
      0.999 * kLonger * kRight_px;
  const std::vector<KeyframeShift> shifts = shifts_now();

  sensor::Camera other = wall.given();
  other.color.fx *= 1.0 + kLonger;
  other.color.fy *= 1.0 + kLonger;
  other.color.cx += kRight_px;
  wall.change(wall.given(), other);

  ASSERT_EQ(shifts.size(), poses.size());
  double largest = 0.0;
  for (std::size_t k = 0; k < poses.size(); ++k) {
    EXPECT_EQ(shifts[k].keyframe, wall.keyframes[k]);
    const Rigid3 step = poses[k] * wall.poses()[k].inverse();
    double squares = 0.0;
    for (const geometry::Vector6d& motion : shifts[k].motions) squares += motion.head<3>().squaredNorm();
    EXPECT_NEAR(std::sqrt(squares), step.translation.norm(), 0.1 * step.translation.norm() + 1e-4) << k;
    largest = std::max(largest, step.translation.norm());
  }
  EXPECT_GT(largest, 0.002);
}

// Rows are corrected anew by the final path's velocities, which moves keyframes, but that is no effect of the
// camera.
TEST(MapRecalibration, WhatNewVelocitiesMoveIsNoShift) {
  FilmedWall wall;
  auto keyframe = std::make_shared<maps::Keyframe>(wall.world.map.keyframe(wall.keyframes[2]));
  auto features = std::make_shared<features::FrameFeatures>(*keyframe->features);
  features->shutter_motion << 0.02, 0.0, 0.01, 0.0, 0.02, 0.0;
  keyframe->features = std::move(features);
  wall.world.map.replace_keyframe(keyframe);
  FilmedWall moved = wall;
  moved.change(moved.given(), moved.given());
  EXPECT_GT(largest_difference(moved.poses(), wall.poses()), 1e-3);

  const optimize::CameraCovariance covariance = 1e-16 * optimize::CameraCovariance::Identity();
  for (const KeyframeShift& shift : camera_shifts(wall.world.map, wall.frames, wall.world.camera,
                                                  wall.given(), covariance, core::Executor(2))) {
    for (const geometry::Vector6d& motion : shift.motions) EXPECT_LT(motion.norm(), 1e-5);
  }
}

/// Ten frames between the first two keyframes of a wall, whose corrected poses drift away from their
/// keyframe.
struct FramesBetween {
  FilmedWall wall;
  std::vector<maps::FramePose> before;
  std::vector<maps::FramePose> corrected;
  std::vector<Rigid3> truth;  ///< camera_from_reference

  explicit FramesBetween(std::size_t seen_points) {
    const core::KeyframeId first = wall.keyframes[0];
    const Rigid3& from_world = wall.world.map.camera_from_world(first);
    for (int i = 1; i <= 10; ++i) {
      const Rigid3 moved(Eigen::Matrix3d::Identity(), Eigen::Vector3d(-0.009 * i, 0.0, -0.009 * i));
      const Rigid3 drift(Eigen::Matrix3d::Identity(), Eigen::Vector3d(0.0007 * i, 0.0, -0.0005 * i));
      maps::FramePose frame;
      frame.stamp = 0.1 * i / 11.0;
      frame.reference = first;
      frame.tracked = true;
      auto seen = std::make_shared<maps::SeenPoints>();
      const Rigid3 camera_from_world = moved * from_world;
      for (std::size_t k = 0; k < std::min(seen_points, wall.world.points.size()); ++k) {
        const Eigen::Vector3d p = camera_from_world * wall.world.points[k];
        seen->points.push_back({wall.world.map.point_ids()[k], wall.world.camera.project(p).cast<float>(),
                                static_cast<float>(p.z()), 0.5F});
      }
      frame.seen = std::move(seen);
      if (i > 1) frame.camera_from_previous = moved * truth.back().inverse();
      frame.step_sigma_m = 0.001;
      truth.push_back(moved);
      frame.camera_from_reference = drift * drift * moved;
      before.push_back(frame);
      frame.camera_from_reference = drift * moved;
      corrected.push_back(frame);
    }
  }
  /// Largest error of a pose after they were solved again.
  [[nodiscard]] double solved(const core::Executor& executor) {
    const geometry::Trajectory path = maps::trajectory(before, wall.world.map);
    solve_frames_again({wall.world.camera, wall.given()}, wall.world.map, before, path, executor, corrected);
    std::vector<Rigid3> poses;
    for (const maps::FramePose& frame : corrected) poses.push_back(frame.camera_from_reference);
    return largest_difference(poses, truth);
  }
};

TEST(MapRecalibration, FramesBetweenKeyframesFollowWhatTheySaw) {
  EXPECT_LT(FramesBetween(60).solved(core::Executor(1)), 0.001);
}

// With too few landmarks the corrected poses and the tracker's steps are all there is.
TEST(MapRecalibration, FramesThatSawLittleStayNearTheirCorrectedPose) {
  FramesBetween few(5);
  const double off = few.solved(core::Executor(1));
  EXPECT_GT(off, 0.0005);
  EXPECT_LT(off, 0.0075);
}

TEST(MapRecalibration, FramesAreSolvedToTheSameBytesByAnyNumberOfThreads) {
  FramesBetween one(60);
  FramesBetween two(60);
  EXPECT_EQ(one.solved(core::Executor(1)), two.solved(core::Executor(2)));
  for (std::size_t i = 0; i < one.corrected.size(); ++i) {
    EXPECT_EQ(one.corrected[i].camera_from_reference.translation,
              two.corrected[i].camera_from_reference.translation);
  }
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
