// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "plumbline/tracking/relocalise.hpp"
#include "tracking_world.hpp"

namespace plumbline::tracking {
namespace {

using geometry::Rigid3;
using tests::kTestCamera;

features::FrameFeatures look(const cv::Mat& poster, const Rigid3& pose) {
  features::FeatureOptions options;
  options.lines = false;
  sensor::RgbdFrame frame;
  frame.gray = tests::render_wall(poster, 300.0, 2.0, pose);
  frame.depth = tests::render_depth({{{0.0, 0.0, 2.0}, {0.0, 0.0, -1.0}, 0.0}}, pose);
  return features::FeatureExtractor(options, kTestCamera).extract(frame);
}

core::KeyframeId add_keyframe(maps::Map& map, const cv::Mat& poster, const Rigid3& pose) {
  auto keyframe = std::make_shared<maps::Keyframe>();
  const auto features = std::make_shared<features::FrameFeatures>(look(poster, pose));
  keyframe->id = map.next_keyframe_id(0);
  keyframe->features = features;
  const core::KeyframeId id = map.add_keyframe(keyframe, pose);
  for (std::size_t i = 0; i < features->points.size(); ++i) {
    const features::PointFeature& f = features->points[i];
    if (!(f.depth > 0.0F)) continue;
    maps::MapPoint point;
    point.position = pose.inverse() * kTestCamera.unproject(static_cast<double>(f.pixel.x()),
                                                            static_cast<double>(f.pixel.y()),
                                                            static_cast<double>(f.depth));
    point.descriptor = features->descriptors[i];
    map.observe(map.add_point(0, point), id, static_cast<int>(i));
  }
  return id;
}

class Relocalise : public testing::Test {
 protected:
  void SetUp() override {
    // Another place, then the poster from two sides: the last is where the picture comes from.
    ids_.push_back(add_keyframe(map_, tests::poster(1200, 77), {}));
    ids_.push_back(add_keyframe(map_, poster_, left_));
    ids_.push_back(add_keyframe(map_, poster_, right_));
  }
  maps::Map map_;
  cv::Mat poster_ = tests::poster(1200, 5);
  Rigid3 left_{geometry::exp_so3({0.0, 0.1, 0.0}), {0.5, 0.0, 0.0}};
  Rigid3 right_{geometry::exp_so3({0.0, -0.1, 0.0}), {-0.5, 0.0, 0.0}};
  std::vector<core::KeyframeId> ids_;
};

TEST_F(Relocalise, FindsPoseAndKeyframe) {
  const Rigid3 truth =
      Rigid3(geometry::exp_so3({0.03, 0.02, 0.25}), {0.02, 0.05, 0.1}) * right_;  // also rolled
  const auto found = relocalise(map_, ids_, look(poster_, truth), kTestCamera, 15);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->keyframe, ids_[2]);
  EXPECT_GE(found->inliers, 40);
  EXPECT_LT(tests::distance(found->camera_from_world, truth), 0.03);
  EXPECT_LT(tests::angle(found->camera_from_world, truth), 0.02);
}

TEST_F(Relocalise, SameAnswerTwiceAndInAnyOrderOfCandidates) {
  const features::FrameFeatures frame = look(poster_, right_);
  const auto a = relocalise(map_, ids_, frame, kTestCamera, 15);
  const auto b = relocalise(map_, ids_, frame, kTestCamera, 15);
  const auto c = relocalise(map_, {ids_[2], ids_[1], ids_[0]}, frame, kTestCamera, 15);
  ASSERT_TRUE(a && b && c);
  EXPECT_EQ(a->camera_from_world.translation, b->camera_from_world.translation);
  EXPECT_EQ(a->camera_from_world.rotation, c->camera_from_world.rotation);
  EXPECT_EQ(a->inliers, c->inliers);
}

TEST_F(Relocalise, RefusesAForeignPicture) {
  EXPECT_FALSE(relocalise(map_, ids_, look(tests::poster(1200, 1234), {}), kTestCamera, 15));
}

TEST_F(Relocalise, RefusesWithoutFeaturesOrCandidates) {
  const features::FrameFeatures frame = look(poster_, right_);
  EXPECT_FALSE(relocalise(map_, {}, frame, kTestCamera, 15));
  EXPECT_FALSE(relocalise(map_, ids_, {}, kTestCamera, 15));
  EXPECT_FALSE(
      relocalise(map_, ids_, look(cv::Mat(1200, 1200, CV_8UC1, cv::Scalar(90)), {}), kTestCamera, 15));
  EXPECT_FALSE(relocalise(map_, ids_, frame, kTestCamera, 5000)) << "never so many inliers";
}

TEST_F(Relocalise, AFewMatchesAreNoPoseWhateverTheThreshold) {
  // P3P needs a fourth point to choose among its solutions.
  const features::FrameFeatures all = look(poster_, right_);
  features::FrameFeatures few = all;
  for (std::size_t n = 0; n <= 4; ++n) {
    few.points.assign(all.points.begin(), all.points.begin() + static_cast<std::ptrdiff_t>(n));
    few.descriptors.assign(all.descriptors.begin(), all.descriptors.begin() + static_cast<std::ptrdiff_t>(n));
    std::optional<Relocalisation> found;
    EXPECT_NO_THROW(found = relocalise(map_, ids_, few, kTestCamera, 3)) << n;
    if (n < 4) {
      EXPECT_FALSE(found) << n;
    }
  }
}

}  // namespace
}  // namespace plumbline::tracking
