// SPDX-License-Identifier: BSD-3-Clause
// Maps of two robots become one where they overlap, and stay two where they do not.
#include <gtest/gtest.h>

#include "plumbline/mapping/merging/map_fusion.hpp"
#include "poster_view.hpp"

namespace plumbline::mapping {
namespace {

using core::KeyframeId;
using geometry::Rigid3;
using tests::kTestCamera;

/// Keyframes along a wall with a poster. The world that the map believes in is `world_from_truth` of the true
/// one.
maps::Map wall_map(int poster, int views, double from_m, const Rigid3& world_from_truth) {
  maps::Map map;
  const cv::Mat wall = tests::poster(1400, static_cast<unsigned>(poster));
  for (int i = 0; i < views; ++i) {
    const Rigid3 pose(geometry::exp_so3({0.0, 0.02 * i, 0.01 * i}), {from_m + 0.09 * i, 0.02 * i, 0.01 * i});
    tests::add_view(map, wall, pose, pose * world_from_truth.inverse(), 1.0 + i);
  }
  return map;
}

const Rigid3 kOtherWorld(geometry::exp_so3({0.2, -0.4, 0.3}), {2.0, -1.0, 0.5});
const Cameras kCameraOf0{{0, kTestCamera}};
const Cameras kCameraOf1{{1, kTestCamera}};

TEST(MapFusion, TwoMapsOfOneWallBecomeOne) {
  const maps::Map a = wall_map(5, 7, -0.35, Rigid3{});
  const maps::Map b = renumbered(wall_map(5, 7, -0.3, kOtherWorld), {{0, 1}});
  const std::vector<MapPart> parts{{&a, kCameraOf0}, {&b, kCameraOf1}};
  const core::Executor executor(2);
  std::vector<MergeEvidence> merges = find_overlaps(parts, {}, executor);
  ASSERT_EQ(merges.size(), 1U);
  ASSERT_TRUE(merges[0].accepted) << merges[0].refused;
  EXPECT_GE(merges[0].consistency.agreeing, 5);
  EXPECT_LT(tests::distance(merges[0].alignment.a_from_b, kOtherWorld.inverse()), 0.03);
  EXPECT_LT(tests::angle(merges[0].alignment.a_from_b, kOtherWorld.inverse()), 0.015);
  EXPECT_GT(merges[0].alignment.covariance(0, 0), 0.0);
  const FusedMap fused = fuse_maps(parts, merges, 0, {});
  EXPECT_EQ(fused.map.keyframe_count(), 14U);
  EXPECT_EQ(fused.parts, (std::vector<std::size_t>{0, 1}));
  EXPECT_GT(fused.merged_points, 100);
  for (const KeyframeId id : b.keyframe_ids()) {
    const Rigid3 truth = b.camera_from_world(id) * kOtherWorld;
    EXPECT_LT(tests::distance(fused.map.camera_from_world(id), truth), 0.03) << id.index;
  }
}

TEST(MapFusion, ThreadsChangeNothing) {
  const maps::Map a = wall_map(5, 6, -0.3, Rigid3{});
  const maps::Map b = renumbered(wall_map(5, 6, -0.25, kOtherWorld), {{0, 1}});
  const std::vector<MapPart> parts{{&a, kCameraOf0}, {&b, kCameraOf1}};
  const core::Executor one(1);
  const core::Executor two(2);
  std::vector<MergeEvidence> x = find_overlaps(parts, {}, one);
  std::vector<MergeEvidence> y = find_overlaps(parts, {}, two);
  EXPECT_EQ(x[0].alignment.a_from_b.translation, y[0].alignment.a_from_b.translation);
  EXPECT_EQ(content_hash(fuse_maps(parts, x, 0, {}).map), content_hash(fuse_maps(parts, y, 0, {}).map));
}

TEST(MapFusion, OtherWallIsNotMerged) {
  const maps::Map a = wall_map(5, 6, -0.3, Rigid3{});
  const maps::Map b = renumbered(wall_map(77, 6, -0.3, kOtherWorld), {{0, 1}});
  const std::vector<MapPart> parts{{&a, kCameraOf0}, {&b, kCameraOf1}};
  const core::Executor executor(1);
  std::vector<MergeEvidence> merges = find_overlaps(parts, {}, executor);
  EXPECT_FALSE(merges[0].accepted);
  EXPECT_FALSE(merges[0].refused.empty());
  EXPECT_EQ(connected_parts(2, merges), (std::vector<std::size_t>{0, 1}));
  const FusedMap alone = fuse_maps(parts, merges, 1, {});
  EXPECT_EQ(alone.map.keyframe_count(), b.keyframe_count());
  EXPECT_EQ(alone.parts, (std::vector<std::size_t>{1}));
}

TEST(MapFusion, OneLookAtAPlaceIsNotEnough) {
  const maps::Map a = wall_map(5, 6, -0.3, Rigid3{});
  const maps::Map b = renumbered(wall_map(5, 1, 0.0, kOtherWorld), {{0, 1}});
  const std::vector<MapPart> parts{{&a, kCameraOf0}, {&b, kCameraOf1}};
  const core::Executor executor(1);
  const std::vector<MergeEvidence> merges = find_overlaps(parts, {}, executor);
  EXPECT_FALSE(merges[0].accepted);
  EXPECT_NE(merges[0].refused.find("are needed"), std::string::npos) << merges[0].refused;
}

TEST(MapFusion, OnePairLeadsToItsNeighbours) {
  const maps::Map a = wall_map(5, 7, -0.35, Rigid3{});
  const maps::Map b = renumbered(wall_map(5, 7, -0.3, kOtherWorld), {{0, 1}});
  const std::vector<MapPart> parts{{&a, kCameraOf0}, {&b, kCameraOf1}};
  const core::Executor executor(1);
  const std::vector<VerifiedPair> one{
      verify_candidate(parts, {b.keyframe_ids()[3], a.keyframe_ids()[3], 1, 0, 0.0}, {})};
  ASSERT_TRUE(one[0].evidence.accepted) << one[0].evidence.refused;
  const MergeEvidence merge = decide_overlap(parts, 0, 1, one, {}, executor);
  EXPECT_TRUE(merge.accepted) << merge.refused;
  EXPECT_GE(merge.consistency.agreeing, 5);
  std::vector<VerifiedPair> wrong = one;
  wrong[0].evidence.query_from_match.translation.x() += 5.0;
  EXPECT_EQ(decide_overlap(parts, 0, 1, wrong, {}, executor).consistency.agreeing, 1)
      << "nothing to be seen there";
}

/// Keyframes without features in a row, `step` apart, and pairs of two such maps.
maps::Map row(std::int32_t robot, int count) {
  maps::Map map;
  for (int i = 0; i < count; ++i) {
    auto keyframe = std::make_shared<maps::Keyframe>();
    keyframe->id = {robot, i};
    keyframe->stamp = i;
    keyframe->features = std::make_shared<features::FrameFeatures>();
    map.add_keyframe(keyframe, Rigid3(Eigen::Matrix3d::Identity(), {-0.5 * i, 0.0, 0.0}));
  }
  return map;
}

VerifiedPair pair_of(int a, int b, const Rigid3& query_from_match) {
  VerifiedPair pair{{0, a}, {1, b}, {}};
  pair.evidence.accepted = true;
  pair.evidence.query_from_match = query_from_match;
  pair.evidence.information = 1e4 * geometry::Matrix6d::Identity();
  return pair;
}

TEST(MapFusion, TwoAnswersAreNone) {
  // A corridor whose doors repeat every 3 m: the same pictures fit with and without a step of one door.
  const maps::Map a = row(0, 20);
  const maps::Map b = row(1, 20);
  const std::vector<MapPart> parts{{&a, kCameraOf0}, {&b, kCameraOf1}};
  const core::Executor executor(1);
  std::vector<VerifiedPair> pairs;
  for (int i = 0; i < 14; ++i) pairs.push_back(pair_of(i, i, Rigid3{}));
  MapFusionOptions options;
  EXPECT_TRUE(decide_overlap(parts, 0, 1, pairs, options, executor).accepted);
  pairs.push_back(pair_of(0, 6, Rigid3{}));
  EXPECT_TRUE(decide_overlap(parts, 0, 1, pairs, options, executor).accepted) << "one may be mistaken";
  for (int i = 1; i < 8; ++i) pairs.push_back(pair_of(i, i + 6, Rigid3{}));
  const MergeEvidence doubtful = decide_overlap(parts, 0, 1, pairs, options, executor);
  EXPECT_FALSE(doubtful.accepted);
  EXPECT_EQ(doubtful.consistency.agreeing, 14);
  EXPECT_EQ(doubtful.ambiguity.alternative, 8);
  EXPECT_NE(doubtful.refused.find("look alike"), std::string::npos) << doubtful.refused;
}

TEST(MapFusion, KeyframesThatShouldSeeTheSameMustDoSo) {
  const maps::Map a = row(0, 20);
  const maps::Map b = row(1, 20);
  const std::vector<MapPart> parts{{&a, kCameraOf0}, {&b, kCameraOf1}};
  const core::Executor executor(1);
  std::vector<VerifiedPair> pairs;
  for (int i = 0; i < 6; ++i) pairs.push_back(pair_of(i, i, Rigid3{}));
  const MergeEvidence merge = decide_overlap(parts, 0, 1, pairs, {}, executor);
  EXPECT_FALSE(merge.accepted);
  EXPECT_EQ(merge.validation.expected, 20);
  EXPECT_EQ(merge.validation.confirmed, 6);
}

TEST(MapFusion, ThreeMapsInARow) {
  const maps::Map a = row(0, 6);
  const maps::Map b = row(1, 6);
  const maps::Map c = row(2, 6);
  const std::vector<MapPart> parts{{&a, kCameraOf0}, {&b, kCameraOf1}, {&c, {{2, kTestCamera}}}};
  std::vector<MergeEvidence> merges(3);
  merges[0].a = 0, merges[0].b = 1;
  merges[1].a = 0, merges[1].b = 2;
  merges[2].a = 1, merges[2].b = 2;
  merges[0].accepted = merges[2].accepted = true;
  merges[0].alignment.a_from_b = Rigid3(Eigen::Matrix3d::Identity(), {1.0, 0.0, 0.0});
  merges[2].alignment.a_from_b = Rigid3(Eigen::Matrix3d::Identity(), {0.0, 1.0, 0.0});
  EXPECT_EQ(connected_parts(3, merges), (std::vector<std::size_t>{0, 0, 0}));
  const FusedMap fused = fuse_maps(parts, merges, 0, {});
  ASSERT_EQ(fused.parts.size(), 3U);
  EXPECT_EQ(fused.anchor_from_part[2].translation, Eigen::Vector3d(1.0, 1.0, 0.0));
  EXPECT_EQ(fused.map.keyframe_count(), 18U);
  merges[2].accepted = false;
  EXPECT_EQ(connected_parts(3, merges), (std::vector<std::size_t>{0, 0, 2}));
}

TEST(MapFusion, ContentTellsMapsApartAndNumbersDoNot) {
  const maps::Map a = wall_map(5, 2, 0.0, Rigid3{});
  EXPECT_EQ(content_hash(a), content_hash(renumbered(a, {{0, 4}})));
  EXPECT_NE(content_hash(a), content_hash(wall_map(5, 2, 0.01, Rigid3{})));
  EXPECT_NE(content_hash(a), content_hash(maps::Map()));
  const maps::Map moved = renumbered(a, {{0, 4}});
  EXPECT_EQ(moved.point_count(), a.point_count());
  EXPECT_EQ(moved.keyframe_ids().front().robot, 4);
  EXPECT_EQ(moved.next_keyframe_id(4).index, a.next_keyframe_id(0).index);
}

}  // namespace
}  // namespace plumbline::mapping
