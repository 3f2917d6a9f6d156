// SPDX-License-Identifier: BSD-3-Clause
// A wall whose corners an older keyframe saw without depth.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "plumbline/features/corner_patch.hpp"
#include "plumbline/mapping/earlier_sightings.hpp"
#include "smooth_picture.hpp"
#include "tracking_world.hpp"

namespace plumbline::mapping {
namespace {

using core::KeyframeId;
using core::PointId;
using geometry::Rigid3;
using tests::kTestCamera;

constexpr double kDistance = 2.0;  // m, of the wall from the older camera
const Rigid3 kNewer(Eigen::Matrix3d::Identity(), {-0.0513, 0.0327, 0.1});
const Rigid3 kMistaken(geometry::exp_so3({0.002, -0.005, 0.0}), Eigen::Vector3d(0.004, 0.0, 0.0));

class EarlierSightings : public testing::Test {
 protected:
  EarlierSightings() {
    std::vector<Eigen::Vector2i> corners;
    for (int y = 60; y < kTestCamera.height - 60; y += 40) {
      for (int x = 60; x < kTestCamera.width - 60; x += 40) {
        corners.emplace_back(x, y);
        wall_.push_back(kTestCamera.unproject(x, y, kDistance));
      }
    }
    older_features_ = look({}, corners, 0.0);
    for (Eigen::Vector2i& c : corners) {
      const Eigen::Vector2d p =
          kTestCamera.project(kNewer * wall_[static_cast<std::size_t>(&c - corners.data())]);
      c = {static_cast<int>(std::lround(p.x())), static_cast<int>(std::lround(p.y()))};
    }
    newer_features_ = look(kNewer, corners, kDistance + kNewer.translation.z());
  }

  /// Corners at these whole pixels of a picture of the wall, all of the same depth; alike by number.
  features::FrameFeatures look(const Rigid3& pose, const std::vector<Eigen::Vector2i>& corners,
                               double depth) const {
    features::FrameFeatures f;
    f.levels = {tests::draw(kTestCamera.width, kTestCamera.height, [&](double u, double v) {
      const Eigen::Vector3d ray = kTestCamera.unproject(u, v, 1.0);
      const Eigen::Vector3d p = pose.inverse() * (ray * (kDistance + pose.translation.z()));
      return waves_(p.x() * 250.0, p.y() * 250.0);
    })};
    std::mt19937 random(3);
    for (const Eigen::Vector2i& c : corners) {
      features::PointFeature p;
      p.pixel = c.cast<float>();
      p.depth = static_cast<float>(depth);
      f.points.push_back(p);
      f.patches.push_back(features::cut_patch(f.levels[0], c.x(), c.y(), p.pixel));
      f.descriptors.emplace_back();
      for (auto& word : f.descriptors.back()) word = static_cast<std::decay_t<decltype(word)>>(random());
    }
    f.grid = features::PointGrid(f.points, kTestCamera.width, kTestCamera.height);
    return f;
  }
  KeyframeId add_keyframe(const Rigid3& pose, const features::FrameFeatures& f) {
    auto keyframe = std::make_shared<maps::Keyframe>();
    keyframe->id = map_.next_keyframe_id(0);
    keyframe->features = std::make_shared<features::FrameFeatures>(f);
    return map_.add_keyframe(keyframe, pose);
  }
  /// The older keyframe, whose pose is a third of a degree off, and the newer one with landmarks.
  void make_map() {
    older_ = add_keyframe(kMistaken, older_features_);
    newer_ = add_keyframe(kNewer, newer_features_);
    const Rigid3 world_from_camera = kNewer.inverse();
    for (std::size_t i = 0; i < newer_features_.points.size(); ++i) {
      const features::PointFeature& f = newer_features_.points[i];
      const Eigen::Vector3d in_camera = kTestCamera.unproject(
          static_cast<double>(f.pixel.x()), static_cast<double>(f.pixel.y()), static_cast<double>(f.depth));
      maps::MapPoint point;
      point.position = world_from_camera * in_camera;
      point.descriptor = newer_features_.descriptors[i];
      point.angle_keyframe = newer_;
      point.view_direction = (point.position - world_from_camera.translation).normalized();
      point.reference_distance = in_camera.norm();
      made_.push_back(map_.add_point(0, point));
      map_.observe(made_.back(), newer_, static_cast<int>(i), true);
    }
  }
  int add(const std::vector<cv::Mat>& levels) {
    return add_earlier_sightings(map_, made_, newer_, {older_}, levels, kTestCamera, {}, newer_features_);
  }
  /// How far the newer keyframe's corner lies from what the older one's corner shows, px.
  double off(std::size_t i) const {
    return (newer_features_.points[i].pixel.cast<double>() - kTestCamera.project(kNewer * wall_[i])).norm();
  }

  tests::Waves waves_{7};
  std::vector<Eigen::Vector3d> wall_;  ///< where the older keyframe's corners lie
  features::FrameFeatures older_features_, newer_features_;
  maps::Map map_;
  KeyframeId older_, newer_;
  std::vector<PointId> made_;
};

TEST_F(EarlierSightings, AreFoundAndExactThoughThePoseIsNot) {
  make_map();
  double before = 0.0;
  for (std::size_t i = 0; i < made_.size(); ++i) before += off(i);
  EXPECT_GT(before / static_cast<double>(made_.size()), 0.25);
  const int found = add(newer_features_.levels);
  EXPECT_GT(found, 9 * static_cast<int>(made_.size()) / 10);
  for (std::size_t i = 0; i < made_.size(); ++i) {
    const maps::MapPoint& point = map_.point(made_[i]);
    if (point.observations.size() < 2) continue;
    EXPECT_EQ(point.observations.back().keyframe, older_);
    EXPECT_EQ(point.observations.back().feature, static_cast<int>(i));
    EXPECT_TRUE(point.observations.back().aligned);
    EXPECT_LT(off(i), 0.15);
    EXPECT_LT((point.position - wall_[i]).norm(), 0.15 / 250.0);
  }
}

TEST_F(EarlierSightings, ACornerThatLiesOffUnlikeTheOthersIsNotBelieved) {
  constexpr std::size_t kOther = 20;
  features::CornerPatch& patch = older_features_.patches[kOther];
  const Eigen::Vector2f aside = older_features_.points[kOther].pixel + Eigen::Vector2f(5.0F, 0.0F);
  older_features_.points[kOther].pixel = aside;
  patch.middle = aside;
  older_features_.grid = features::PointGrid(older_features_.points, kTestCamera.width, kTestCamera.height);
  make_map();
  EXPECT_GT(add(newer_features_.levels), 0);
  EXPECT_EQ(map_.point(made_[kOther]).observations.size(), 1U);
}

TEST_F(EarlierSightings, CornersThatSeeSomethingStayAsTheyAre) {
  make_map();
  const PointId known = map_.add_point(0, {});
  map_.observe(known, older_, 7);
  EXPECT_GT(add(newer_features_.levels), 0);
  EXPECT_EQ(map_.point_of(older_, 7), known);
  EXPECT_EQ(map_.point(made_[7]).observations.size(), 1U);
}

TEST_F(EarlierSightings, NoneWithoutAPictureOrAtBorders) {
  make_map();
  EXPECT_EQ(add({}), 0);
  for (features::CornerPatch& p : newer_features_.patches) p.gray.fill(0);
  EXPECT_EQ(add(newer_features_.levels), 0);
  for (const PointId id : made_) EXPECT_EQ(map_.point(id).observations.size(), 1U);
}

}  // namespace
}  // namespace plumbline::mapping
