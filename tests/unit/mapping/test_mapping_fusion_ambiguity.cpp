// SPDX-License-Identifier: BSD-3-Clause
// Keyframes agree on how two maps lie: is there another answer that is as good?
#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "../../../src/mapping/merging/free_direction.hpp"
#include "../../../src/mapping/merging/map_overlay.hpp"
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
  options.min_confirmed = 0.0;  // this is about the maps as a whole
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

/// How many spots match when the wall is laid over itself, a repetition further.
int spots_a_step_further(const cv::Mat& wall) {
  const maps::Map a = walk(wall);
  const maps::Map b = as_second(a);
  const MapOverlay maps({&a, {{0, kTestCamera}}}, {&b, {{1, kTestCamera}}});
  const Eigen::Vector3d step(1.2, 0.0, 0.0);
  return maps.matching_spots(Rigid3(Eigen::Matrix3d::Identity(), step), step);
}

TEST(FusionAmbiguity, AStripMatchesAtOneSpotAndAWallAtMany) {
  cv::Mat wall = repeating_wall();
  EXPECT_GE(spots_a_step_further(wall), 3);
  const int middle = wall.rows / 2;
  wall.rowRange(0, middle - 25).setTo(128);
  wall.rowRange(middle + 25, wall.rows).setTo(128);
  EXPECT_EQ(spots_a_step_further(wall), 1);
  EXPECT_EQ(spots_a_step_further(cv::Mat(wall.size(), wall.type(), cv::Scalar(128))), 0);
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
  other.few_inliers = 1000000;
  EXPECT_FALSE(decide(a, as_second(a), Rigid3{}, other).accepted);
  other = few;
  other.few_pairs = 49;
  EXPECT_FALSE(decide(a, as_second(a), Rigid3{}, other).accepted);
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
  EXPECT_TRUE(merge.accepted) << merge.refused;
  EXPECT_EQ(merge.ambiguity.overlap.expected, 0);
  EXPECT_EQ(merge.ambiguity.overlap.seen_through(), 0.0);
  MapFusionOptions few;
  few.min_pairs = 50;
  few.few_extent_m = 0.3;
  EXPECT_NE(decide(a, as_second(a), Rigid3{}, few).refused.find("0 pieces of surface"), std::string::npos);
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
