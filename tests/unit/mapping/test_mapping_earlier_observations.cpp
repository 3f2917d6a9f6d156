// SPDX-License-Identifier: BSD-3-Clause
// A wall whose corners an older keyframe saw without depth.
#include <gtest/gtest.h>

#include "plumbline/mapping/earlier_observations.hpp"
#include "two_views_of_a_wall.hpp"

namespace plumbline::mapping {
namespace {

using core::KeyframeId;
using core::PointId;
using geometry::Rigid3;
using tests::kTestCamera;

const Rigid3 kMistaken(geometry::exp_so3({0.002, -0.005, 0.0}), Eigen::Vector3d(0.004, 0.0, 0.0));

class EarlierObservations : public testing::Test {
 protected:
  /// The older keyframe, whose pose is a third of a degree off, and the newer one with landmarks.
  void make_map() {
    features::FrameFeatures& newest = *views_.newer;
    for (features::PointFeature& p : newest.points)
      p.depth = static_cast<float>(views_.kDistance + views_.newer_from_world.translation.z());
    older_ = views_.add_keyframe(kMistaken, views_.older);
    newer_ = views_.add_keyframe(views_.newer_from_world, views_.newer);
    const Rigid3 world_from_camera = views_.newer_from_world.inverse();
    for (std::size_t i = 0; i < newest.points.size(); ++i) {
      const features::PointFeature& f = newest.points[i];
      const Eigen::Vector3d in_camera = kTestCamera.unproject(
          static_cast<double>(f.pixel.x()), static_cast<double>(f.pixel.y()), static_cast<double>(f.depth));
      maps::MapPoint point;
      point.position = world_from_camera * in_camera;
      point.descriptor = newest.descriptors[i];
      point.angle_keyframe = newer_;
      point.view_direction = (point.position - world_from_camera.translation).normalized();
      point.reference_distance = in_camera.norm();
      made_.push_back(map_.add_point(0, point));
      map_.observe(made_.back(), newer_, static_cast<int>(i), true);
    }
  }
  int add(const std::vector<cv::Mat>& levels) {
    return add_earlier_observations(map_, made_, newer_, {older_}, levels, kTestCamera, {}, *views_.newer);
  }

  tests::TwoViewsOfAWall views_;
  maps::Map& map_ = views_.map;
  KeyframeId older_, newer_;
  std::vector<PointId> made_;
};

TEST_F(EarlierObservations, AreFoundAndExactThoughThePoseIsNot) {
  make_map();
  EXPECT_GT(views_.mean_off(), 0.25);
  const int found = add(views_.newer->levels);
  EXPECT_GT(found, 9 * static_cast<int>(made_.size()) / 10);
  for (std::size_t i = 0; i < made_.size(); ++i) {
    const maps::MapPoint& point = map_.point(made_[i]);
    if (point.observations.size() < 2) continue;
    EXPECT_EQ(point.observations.back().keyframe, older_);
    EXPECT_EQ(point.observations.back().feature, static_cast<int>(i));
    EXPECT_TRUE(point.observations.back().aligned);
    EXPECT_LT(views_.off(i), 0.15);
    EXPECT_LT((point.position - views_.wall[i]).norm(), 0.15 / 250.0);
  }
}

TEST_F(EarlierObservations, ACornerThatLiesOffUnlikeTheOthersIsNotBelieved) {
  constexpr std::size_t kOther = 20;
  features::FrameFeatures& older = *views_.older;
  const Eigen::Vector2f aside = older.points[kOther].pixel + Eigen::Vector2f(5.0F, 0.0F);
  older.points[kOther].pixel = aside;
  older.patches[kOther].middle = aside;
  older.grid = features::PointGrid(older.points, kTestCamera.width, kTestCamera.height);
  make_map();
  EXPECT_GT(add(views_.newer->levels), 0);
  EXPECT_EQ(map_.point(made_[kOther]).observations.size(), 1U);
}

TEST_F(EarlierObservations, CornersThatSeeSomethingStayAsTheyAre) {
  make_map();
  const PointId known = map_.add_point(0, {});
  map_.observe(known, older_, 7);
  EXPECT_GT(add(views_.newer->levels), 0);
  EXPECT_EQ(map_.point_of(older_, 7), known);
  EXPECT_EQ(map_.point(made_[7]).observations.size(), 1U);
}

TEST_F(EarlierObservations, NoneWithoutAPictureOrAtBorders) {
  make_map();
  EXPECT_EQ(add({}), 0);
  for (features::CornerPatch& p : views_.newer->patches) p.gray.fill(0);
  EXPECT_EQ(add(views_.newer->levels), 0);
  for (const PointId id : made_) EXPECT_EQ(map_.point(id).observations.size(), 1U);
}

}  // namespace
}  // namespace plumbline::mapping
