// SPDX-License-Identifier: BSD-3-Clause
// Keyframes agree on how two maps lie: is there another answer that is as good?
#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/core.hpp>
#include <vector>

#include "../../../src/mapping/merging/free_direction.hpp"
#include "../../../src/mapping/merging/picture_overlay.hpp"
#include "plumbline/mapping/merging/map_fusion.hpp"
#include "poster_view.hpp"

namespace plumbline::mapping {
namespace {

using core::KeyframeId;
using geometry::Rigid3;
using tests::kTestCamera;

constexpr int kViews = 6;
constexpr double kStep_m = 0.1;

/// Every landmark is seen twice, as those are that maps keep.
void add_landmarks_seen_twice(maps::Map& map, const cv::Mat& wall, const Rigid3& camera_from_world,
                              const std::vector<tests::WorldPlane>& boards) {
  const KeyframeId first = tests::add_view(map, wall, camera_from_world, camera_from_world, 1.0, boards);
  const KeyframeId second = tests::add_view(map, wall, camera_from_world, camera_from_world, 1.5, boards);
  const std::vector<core::PointId> kept = map.points_of(first);
  const std::vector<core::PointId> gone = map.points_of(second);
  for (std::size_t i = 0; i < kept.size() && i < gone.size(); ++i) {
    if (kept[i].valid() && gone[i].valid()) map.merge(kept[i], gone[i]);
  }
}

/// A robot that looks at a wall 2 m away and goes along it.
maps::Map walk(const cv::Mat& wall, const std::vector<tests::WorldPlane>& boards = {}) {
  maps::Map map;
  for (int i = 0; i < kViews; ++i) {
    add_landmarks_seen_twice(map, wall, Rigid3(Eigen::Matrix3d::Identity(), {-kStep_m * i, 0.0, 0.0}),
                             boards);
  }
  return map;
}

/// A poster of 1.2 m, over and over.
cv::Mat repeating_wall() {
  cv::Mat wall;
  cv::repeat(tests::poster(360, 5), 4, 6, wall);
  return wall;
}

/// b's keyframes see what a's see, `shift` away from where the maps have them.
MergeEvidence decide(const maps::Map& a, const maps::Map& b, const Rigid3& shift,
                     MapFusionOptions options = {}) {
  std::vector<VerifiedPair> pairs;
  for (int i = 0; i < 2 * kViews; ++i) {
    VerifiedPair pair{{0, i}, {1, i}, {}};
    pair.evidence.accepted = true;
    pair.evidence.query_from_match = shift;
    pair.evidence.points = 150;
    pairs.push_back(pair);
  }
  const core::Executor executor(1);
  return decide_overlap({{&a, {{0, kTestCamera}}}, {&b, {{1, kTestCamera}}}}, 0, 1, pairs, options, executor);
}

maps::Map as_second(const maps::Map& map) { return renumbered(map, {{0, 1}}); }

TEST(FusionAmbiguity, OneWallHasOneAnswer) {
  const maps::Map a = walk(tests::poster(1800, 5));
  const MergeEvidence merge = decide(a, as_second(a), Rigid3{});
  EXPECT_TRUE(merge.accepted) << merge.refused;
  EXPECT_GT(merge.ambiguity.overlap.expected, 200);
  EXPECT_EQ(merge.ambiguity.overlap.matched, merge.ambiguity.overlap.expected);
  EXPECT_GT(merge.ambiguity.overlap.share(), 0.5) << "the poster is crowded: chance matches some too";
  EXPECT_LT(merge.ambiguity.overlap.seen_through(), 0.02);
  EXPECT_EQ(merge.ambiguity.alternative_m, 0.0);
}

TEST(FusionAmbiguity, WhatRepeatsHasSeveral) {
  const maps::Map a = walk(repeating_wall());
  const MergeEvidence merge = decide(a, as_second(a), Rigid3{});
  EXPECT_FALSE(merge.accepted);
  EXPECT_EQ(merge.ambiguity.alternative, 0) << "no keyframe says so";
  EXPECT_NEAR(merge.ambiguity.alternative_m, 1.2, 0.1);
  EXPECT_GT(merge.ambiguity.alternative_overlap.matched, 30);
  EXPECT_NE(merge.refused.find("look alike"), std::string::npos) << merge.refused;
}

TEST(FusionAmbiguity, WhatStandsBeforeItOnlyOnceTellsThatAStepIsWrong) {
  cv::Mat wall;  // repeats along the way only
  cv::repeat(tests::poster(1440, 5).colRange(0, 360), 1, 6, wall);
  const maps::Map bare = walk(wall);
  EXPECT_NEAR(decide(bare, as_second(bare), Rigid3{}).ambiguity.alternative_m, 1.2, 0.1);
  const maps::Map a = walk(wall, {{{0.25, 0.0, 1.5}, {0.0, 0.0, -1.0}, 0.5}});
  const MergeEvidence merge = decide(a, as_second(a), Rigid3{});
  EXPECT_TRUE(merge.accepted) << merge.refused;
  EXPECT_EQ(merge.ambiguity.alternative_m, 0.0);
}

std::vector<double> correlations(const maps::Map& a, const maps::Map& b, const Rigid3& a_from_b = {}) {
  return picture_correlations({&a, {{0, kTestCamera}}}, {&b, {{1, kTestCamera}}}, a_from_b);
}

TEST(FusionAmbiguity, PicturesTellTheSameWallFromAnother) {
  const maps::Map a = walk(tests::poster(1800, 5));
  const std::vector<double> same = correlations(a, as_second(a));
  const PictureOdds odds;
  ASSERT_GT(same.size(), 30U);
  EXPECT_GT(*std::min_element(same.begin(), same.end()), 0.9);
  EXPECT_GT(odds.of_one_place(same), 9.2);
  EXPECT_GT(odds.against_like(same), 1.0);

  const std::vector<double> other = correlations(a, as_second(walk(tests::poster(1800, 6))));
  EXPECT_LT(odds.of_one_place(other), -9.2);
  const std::vector<double> beside =
      correlations(a, as_second(a), Rigid3(Eigen::Matrix3d::Identity(), {0.4, 0.0, 0.0}));
  EXPECT_LT(odds.of_one_place(beside), -9.2) << "the same wall, 0.4 m beside";
  EXPECT_TRUE(correlations(a, as_second(a), Rigid3(Eigen::Matrix3d::Identity(), {0.0, 0.0, 9.0})).empty());
}

TEST(FusionAmbiguity, AThirdOfOtherPicturesIsALikePlace) {
  cv::Mat wall = tests::poster(1800, 5);
  const maps::Map a = walk(wall);
  tests::poster(1800, 6).rowRange(0, 800).copyTo(wall.rowRange(0, 800));
  const std::vector<double> mixed = correlations(a, as_second(walk(wall)));
  EXPECT_GT(PictureOdds().of_one_place(mixed), 0.0) << "most of it is the same";
  EXPECT_LT(PictureOdds().against_like(mixed), -3.0);
}

TEST(FusionAmbiguity, MapsThatContradictAreNotMerged) {
  const maps::Map a = walk(tests::poster(1800, 5));
  const MergeEvidence merge = decide(a, as_second(a), Rigid3(Eigen::Matrix3d::Identity(), {0.0, 0.0, -0.8}));
  EXPECT_FALSE(merge.accepted);
  EXPECT_GT(merge.ambiguity.overlap.seen_through(), 0.3);
  EXPECT_NE(merge.refused.find("seen through"), std::string::npos) << merge.refused;
}

TEST(FusionAmbiguity, FewKeyframesWillDoWhenMapsShowThatNothingRepeats) {
  const maps::Map a = walk(tests::poster(1800, 5));
  MapFusionOptions few;
  few.min_pairs = 50;  // more than there are
  few.few_extent_m = 0.3;
  const MergeEvidence merge = decide(a, as_second(a), Rigid3{}, few);
  EXPECT_TRUE(merge.accepted) << merge.refused;
  EXPECT_LT(merge.consistency.agreeing, few.min_pairs);
  const maps::Map repeats = walk(repeating_wall());
  EXPECT_FALSE(decide(repeats, as_second(repeats), Rigid3{}, few).accepted);

  MapFusionOptions other = few;
  other.few_extent_m = 1.0;  // the maps are of 0.5 m
  EXPECT_NE(decide(a, as_second(a), Rigid3{}, other).refused.find("are needed"), std::string::npos);
  other = few;
  other.prior_wrong = 1e-300;
  EXPECT_NE(decide(a, as_second(a), Rigid3{}, other).refused.find("to 1 are needed"), std::string::npos);
}

TEST(FusionAmbiguity, MapsWithoutLandmarksTellNothing) {
  maps::Map a;
  for (int i = 0; i < 2 * kViews; ++i) {
    auto keyframe = std::make_shared<maps::Keyframe>();
    keyframe->id = {0, i};
    keyframe->features = std::make_shared<features::FrameFeatures>();
    a.add_keyframe(keyframe, Rigid3(Eigen::Matrix3d::Identity(), {-kStep_m * i, 0.0, 0.0}));
  }
  const MergeEvidence merge = decide(a, as_second(a), Rigid3{});
  EXPECT_FALSE(merge.accepted) << "keyframes of four places alone";
  EXPECT_EQ(merge.ambiguity.overlap.expected, 0);
  EXPECT_EQ(merge.ambiguity.overlap.seen_through(), 0.0);
  EXPECT_EQ(merge.ambiguity.overlap.log_odds, 0.0);
  EXPECT_NE(merge.refused.find("to 1 are needed"), std::string::npos) << merge.refused;
  MapFusionOptions generous;
  generous.prior_wrong = 0.01;
  EXPECT_TRUE(decide(a, as_second(a), Rigid3{}, generous).accepted);
}

/// Pieces of walls that face these directions, seen by cameras that go along x.
maps::Map hall(const std::vector<Eigen::Vector3f>& normals, double path_m) {
  maps::Map map;
  for (int i = 0; i < 3; ++i) {
    auto keyframe = std::make_shared<maps::Keyframe>();
    keyframe->id = {0, i};
    for (const Eigen::Vector3f& normal : normals) keyframe->surface.push_back({normal, normal, 0.01F});
    map.add_keyframe(keyframe, Rigid3(Eigen::Matrix3d::Identity(), {-0.5 * path_m * i, 0.0, 0.0}));
  }
  return map;
}

FreeDirection free_of(const maps::Map& a) {
  std::vector<VerifiedPair> pairs;
  for (int i = 0; i < 3; ++i) pairs.push_back({{1, i}, {0, i}, {}});
  return free_direction(a, as_second(a), Rigid3{}, pairs);
}

TEST(FusionAmbiguity, ACorridorSlidesAlongItselfAndARoomDoesNot) {
  const Eigen::Vector3f x(1.0F, 0.0F, 0.0F);
  const Eigen::Vector3f y(0.0F, 1.0F, 0.0F);
  const Eigen::Vector3f z(0.0F, 0.0F, 1.0F);
  EXPECT_FALSE(free_of(hall({x, y, z}, 1.0)).slides());
  const FreeDirection corridor = free_of(hall({y, z}, 2.0));
  EXPECT_TRUE(corridor.slides());
  EXPECT_TRUE(corridor.corridor());
  EXPECT_NEAR(corridor.reach_m, 2.0, 1e-9);
  const FreeDirection wall = free_of(hall({z}, 2.0));
  EXPECT_TRUE(wall.slides());
  EXPECT_FALSE(wall.corridor());
  EXPECT_NEAR(wall.reach_m, 2.0, 1e-9);
  EXPECT_NEAR(free_of(hall({x, z}, 2.0)).reach_m, 0.0, 1e-9) << "across the way";
  EXPECT_TRUE(free_of(hall({}, 1.0)).slides());
}

}  // namespace
}  // namespace plumbline::mapping
