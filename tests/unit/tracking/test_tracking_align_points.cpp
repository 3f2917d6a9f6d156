// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>

#include "plumbline/features/frame_features.hpp"
#include "plumbline/tracking/align_points.hpp"
#include "smooth_picture.hpp"
#include "tracking_world.hpp"

namespace plumbline::tracking {
namespace {

using geometry::Rigid3;
using tests::kTestCamera;

constexpr double kWall_m = 2.0;  // m, of the wall that all pictures show

/// A wall of waves, square to the first camera unless it is slanted. The camera only moves sideways and back.
class WallWorld : public testing::Test {
 protected:
  static Rigid3 camera_at(double x, double y, double back) {
    return {Eigen::Matrix3d::Identity(), {-x, -y, back}};
  }

  cv::Mat film(const Rigid3& camera_from_world) const {
    return tests::draw(kTestCamera.width, kTestCamera.height, [&](double u, double v) {
      const Eigen::Vector3d p = on_wall(camera_from_world, u, v);
      return waves_(p.x() * 250.0, p.y() * 250.0);
    });
  }
  /// What of the wall a pixel shows, world.
  Eigen::Vector3d on_wall(const Rigid3& camera_from_world, double u, double v) const {
    const Rigid3 world_from_camera = camera_from_world.inverse();
    const Eigen::Vector3d ray = world_from_camera.rotation * kTestCamera.unproject(u, v, 1.0);
    const Eigen::Vector3d to_wall = Eigen::Vector3d(0, 0, kWall_m) - world_from_camera.translation;
    return world_from_camera.translation + ray * (normal_.dot(to_wall) / normal_.dot(ray));
  }
  /// Features with a corner at each of these whole pixels, in octave 0.
  features::FrameFeatures features_of(const Rigid3& pose, const std::vector<Eigen::Vector2i>& corners) const {
    features::FrameFeatures f;
    f.levels = {film(pose)};
    for (const Eigen::Vector2i& c : corners) {
      features::PointFeature p;
      p.pixel = c.cast<float>();
      f.points.push_back(p);
      f.descriptors.emplace_back();
      f.patches.push_back(features::cut_patch(f.levels[0], c.x(), c.y(), p.pixel));
    }
    return f;
  }
  core::KeyframeId add_keyframe(const Rigid3& pose, features::FrameFeatures f) {
    auto keyframe = std::make_shared<maps::Keyframe>();
    keyframe->id = map_.next_keyframe_id(0);
    f.levels.clear();
    keyframe->features = std::make_shared<features::FrameFeatures>(std::move(f));
    return map_.add_keyframe(keyframe, pose);
  }
  /// Landmarks of all corners of a keyframe.
  void found(core::KeyframeId id) {
    const auto& points = map_.keyframe(id).features->points;
    for (std::size_t i = 0; i < points.size(); ++i) {
      maps::MapPoint point;
      const Eigen::Vector2d pixel = points[i].pixel.cast<double>();
      point.position = on_wall(map_.camera_from_world(id), pixel.x(), pixel.y());
      ids_.push_back(map_.add_point(0, point));
      map_.observe(ids_.back(), id, static_cast<int>(i), true);
    }
  }
  /// Corners where the landmarks are seen, to the whole pixel.
  std::vector<Eigen::Vector2i> corners_at(const Rigid3& pose) const {
    std::vector<Eigen::Vector2i> corners;
    for (const core::PointId id : ids_) {
      const Eigen::Vector2d p = kTestCamera.project(pose * map_.point(id).position);
      corners.emplace_back(static_cast<int>(std::lround(p.x())), static_cast<int>(std::lround(p.y())));
    }
    return corners;
  }
  std::vector<PointMatch> all_matches() const {
    std::vector<PointMatch> matches;
    for (std::size_t i = 0; i < ids_.size(); ++i) {
      PointMatch m;
      m.point = ids_[i];
      m.feature = static_cast<int>(i);
      matches.push_back(m);
    }
    return matches;
  }
  /// Rms over x and y of where the matches lie from where the landmarks are seen, px; of those that are
  /// aligned.
  double error(const features::FrameFeatures& f, const Rigid3& pose, const std::vector<PointMatch>& matches,
               int& aligned) const {
    double sum = 0.0;
    aligned = 0;
    for (const PointMatch& m : matches) {
      if (!m.aligned) continue;
      ++aligned;
      const Eigen::Vector2d at =
          (f.points[static_cast<std::size_t>(m.feature)].pixel + m.shift).cast<double>();
      sum += (at - kTestCamera.project(pose * map_.point(m.point).position)).squaredNorm();
    }
    return std::sqrt(sum / std::max(1, 2 * aligned));
  }

  tests::Waves waves_{7};
  Eigen::Vector3d normal_ = -Eigen::Vector3d::UnitZ();  ///< of the wall, towards the camera
  maps::Map map_;
  std::vector<core::PointId> ids_;
};

std::vector<Eigen::Vector2i> grid() {
  std::vector<Eigen::Vector2i> corners;
  for (int y = 60; y < kTestCamera.height - 60; y += 40) {
    for (int x = 60; x < kTestCamera.width - 60; x += 40) corners.emplace_back(x, y);
  }
  return corners;
}

TEST_F(WallWorld, CornersMoveFromWholePixelsToTheLandmarks) {
  const Rigid3 first = camera_at(0, 0, 0);
  found(add_keyframe(first, features_of(first, grid())));
  const Rigid3 pose = camera_at(0.0513, -0.0327, 0.1);
  const features::FrameFeatures frame = features_of(pose, corners_at(pose));
  std::vector<PointMatch> matches = all_matches();
  // The pose of the guess is a little off: only directions and sizes are taken from it.
  align_points(map_, frame, kTestCamera, camera_at(0.055, -0.03, 0.11), 1.2, matches);
  int aligned = 0;
  EXPECT_LT(error(frame, pose, matches, aligned), 0.06);
  EXPECT_GT(aligned, 9 * static_cast<int>(ids_.size()) / 10);
  for (PointMatch& m : matches) m.shift.setZero();
  EXPECT_GT(error(frame, pose, matches, aligned), 0.2) << "corners were as good before";
}

TEST_F(WallWorld, SlantedSurfacesAreForeshortenedAsTheyAre) {
  normal_ = Eigen::Vector3d(1.0, 0.3, -0.6).normalized();
  const Rigid3 first = camera_at(0, 0, 0);
  std::vector<Eigen::Vector2i> corners = grid();
  // The wall's far end is out of reach.
  corners.erase(std::remove_if(corners.begin(), corners.end(),
                               [](const Eigen::Vector2i& c) { return c.x() > kTestCamera.width / 2; }),
                corners.end());
  found(add_keyframe(first, features_of(first, corners)));
  const Rigid3 pose = camera_at(-0.25, 0.0, -0.1);
  const features::FrameFeatures frame = features_of(pose, corners_at(pose));
  std::vector<PointMatch> matches = all_matches();
  int aligned = 0, across = 0;
  align_points(map_, frame, kTestCamera, pose, 1.2, matches);
  const double error_across = error(frame, pose, matches, across);
  for (const core::PointId id : ids_) map_.point(id).normal = normal_;
  align_points(map_, frame, kTestCamera, pose, 1.2, matches);
  EXPECT_LT(error(frame, pose, matches, aligned), 0.06);
  EXPECT_GT(error_across, 0.1) << "planes across the line of sight would do as well";
  EXPECT_GT(aligned, across);
  EXPECT_GT(aligned, 8 * static_cast<int>(ids_.size()) / 10);
}

TEST_F(WallWorld, WhatWasAlignedOnceIsAlignedWithWhenItsKeyframeIsTheOldestLeft) {
  const Rigid3 first = camera_at(0, 0, 0);
  const core::KeyframeId oldest = add_keyframe(first, features_of(first, grid()));
  found(oldest);
  const Rigid3 second = camera_at(0.0513, -0.0327, 0.1);
  features::FrameFeatures frame = features_of(second, corners_at(second));
  std::vector<PointMatch> matches = all_matches();
  align_points(map_, frame, kTestCamera, second, 1.2, matches);
  for (const PointMatch& m : matches) {  // as the tracker leaves them to a keyframe
    const auto i = static_cast<std::size_t>(m.feature);
    frame.points[i].pixel += m.shift;
    frame.patches[i].offset = m.shift;
  }
  const core::KeyframeId newer = add_keyframe(second, frame);
  for (const PointMatch& m : matches) map_.observe(m.point, newer, m.feature, m.aligned);
  map_.attach(newer);
  for (const PointMatch& m : matches) map_.unobserve(m.point, oldest);

  const Rigid3 third = camera_at(0.09, 0.02, 0.05);
  const features::FrameFeatures later = features_of(third, corners_at(third));
  matches = all_matches();
  align_points(map_, later, kTestCamera, third, 1.2, matches);
  int aligned = 0;
  EXPECT_LT(error(later, third, matches, aligned), 0.08) << "the offset of the patch counts";
  EXPECT_GT(aligned, 8 * static_cast<int>(ids_.size()) / 10);
}

TEST_F(WallWorld, NothingMovesWithoutPatchesOrPictureOrFromFarAside) {
  const Rigid3 first = camera_at(0, 0, 0);
  found(add_keyframe(first, features_of(first, grid())));
  const auto none_aligned = [&](const features::FrameFeatures& frame, const Rigid3& pose) {
    std::vector<PointMatch> matches = all_matches();
    for (PointMatch& m : matches) {
      m.aligned = true;
      m.shift = {1.0F, 1.0F};
    }
    align_points(map_, frame, kTestCamera, pose, 1.2, matches);
    return std::none_of(matches.begin(), matches.end(),
                        [](const PointMatch& m) { return m.aligned || !m.shift.isZero(); });
  };
  features::FrameFeatures frame = features_of(first, grid());
  const Rigid3 aside(geometry::exp_so3({0.0, 0.7, 0.0}), {-1.4, 0.0, 0.5});
  EXPECT_TRUE(none_aligned(frame, aside)) << "40 degrees aside";
  EXPECT_FALSE(none_aligned(frame, first));
  for (const core::PointId id : ids_) {
    const maps::Observation o = map_.point(id).observations.front();
    map_.unobserve(id, o.keyframe);
    map_.observe(id, o.keyframe, o.feature, false);
  }
  EXPECT_TRUE(none_aligned(frame, first)) << "it is not known which place of the patch the landmark is";
  frame.levels.clear();
  EXPECT_TRUE(none_aligned(frame, first)) << "no picture";
}

}  // namespace
}  // namespace plumbline::tracking
