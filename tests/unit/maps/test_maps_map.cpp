// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <set>
#include <stdexcept>

#include "plumbline/maps/map.hpp"
#include "random_world.hpp"

namespace plumbline::maps {
namespace {

using tests::Random;

/// A keyframe with so many point and line features.
KeyframeId add_keyframe(Map& map, std::int32_t robot, std::size_t points, std::size_t lines,
                        const geometry::Rigid3& pose = {}) {
  auto features = std::make_shared<features::FrameFeatures>();
  features->points.resize(points);
  features->descriptors.resize(points);
  features->lines.resize(lines);
  auto keyframe = std::make_shared<Keyframe>();
  keyframe->id = map.next_keyframe_id(robot);
  keyframe->features = features;
  return map.add_keyframe(keyframe, pose);
}

/// Landmarks that two keyframes share, counted the slow way.
int shared_by_counting(const Map& map, KeyframeId a, KeyframeId b) {
  int count = 0;
  for (PointId p : map.points_of(a)) {
    if (!p.valid()) continue;
    for (PointId q : map.points_of(b)) count += p == q ? 1 : 0;
  }
  for (LineId p : map.lines_of(a)) {
    if (!p.valid()) continue;
    for (LineId q : map.lines_of(b)) count += p == q ? 1 : 0;
  }
  return count;
}

void expect_consistent(const Map& map) {
  for (KeyframeId a : map.keyframe_ids()) {
    std::map<KeyframeId, int> shared;
    for (const auto& [id, count] : map.covisible(a, 1)) shared[id] = count;
    for (KeyframeId b : map.keyframe_ids()) {
      if (a == b) {
        ASSERT_EQ(shared.count(a), 0U);
        continue;
      }
      const int expected = shared_by_counting(map, a, b);
      ASSERT_EQ(shared.count(b) != 0 ? shared[b] : 0, expected);
    }
    const auto& points = map.points_of(a);
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!points[i].valid()) continue;
      const MapPoint* point = map.find(points[i]);
      ASSERT_NE(point, nullptr) << "a feature names a point that is gone";
      int seen = 0;
      for (const Observation& o : point->observations) {
        if (o.keyframe == a) {
          ++seen;
          ASSERT_EQ(o.feature, static_cast<int>(i));
        }
      }
      ASSERT_EQ(seen, 1);
    }
  }
  for (PointId id : map.point_ids()) {
    for (const Observation& o : map.point(id).observations)
      ASSERT_EQ(map.point_of(o.keyframe, o.feature), id);
  }
  for (LineId id : map.line_ids()) {
    for (const Observation& o : map.line(id).observations) ASSERT_EQ(map.line_of(o.keyframe, o.feature), id);
  }
}

TEST(Map, OneFeatureOneLandmarkAndTheOtherWayRound) {
  Map map;
  const KeyframeId a = add_keyframe(map, 0, 3, 2);
  const PointId p = map.add_point(0, {});
  const PointId q = map.add_point(0, {});
  EXPECT_TRUE(map.observe(p, a, 0));
  EXPECT_FALSE(map.observe(q, a, 0)) << "the feature is taken";
  EXPECT_FALSE(map.observe(p, a, 1)) << "the keyframe sees the point already";
  EXPECT_FALSE(map.point_of(a, 1).valid());
  EXPECT_EQ(map.point(p).observations.size(), 1U);
  EXPECT_TRUE(map.point(q).observations.empty());
  EXPECT_TRUE(map.observe(q, a, 1));

  const LineId l = map.add_line(0, {});
  const LineId m = map.add_line(0, {});
  EXPECT_TRUE(map.observe(l, a, 1));
  EXPECT_FALSE(map.observe(m, a, 1));
  EXPECT_FALSE(map.observe(l, a, 0));
  expect_consistent(map);
}

TEST(Map, WhatWasAlignedWithAnotherLandmarkIsNotAlignedAfterAMerger) {
  Map map;
  const KeyframeId a = add_keyframe(map, 0, 2, 0);
  const KeyframeId b = add_keyframe(map, 0, 2, 0);
  const KeyframeId c = add_keyframe(map, 0, 2, 0);
  const PointId kept = map.add_point(0, {});
  const PointId gone = map.add_point(0, {});
  map.observe(kept, a, 0, true);
  map.observe(kept, b, 0);
  map.observe(gone, c, 1, true);
  map.merge(kept, gone);
  const std::vector<Observation>& seen = map.point(kept).observations;
  ASSERT_EQ(seen.size(), 3U);
  EXPECT_TRUE(seen[0].aligned);
  EXPECT_FALSE(seen[1].aligned);
  EXPECT_FALSE(seen[2].aligned) << "its own patch shows another place";
}

TEST(Map, OnlyTheNewestKeyframesOfEachRobotKeepPatches) {
  Map map;
  const auto add = [&](std::int32_t robot) {
    auto features = std::make_shared<features::FrameFeatures>();
    features->points.resize(2);
    features->descriptors.resize(2);
    features->patches.resize(2);
    auto keyframe = std::make_shared<Keyframe>();
    keyframe->id = map.next_keyframe_id(robot);
    keyframe->stamp = 0.5;
    keyframe->features = features;
    map.add_keyframe(keyframe, {});
    return std::shared_ptr<const Keyframe>(keyframe);
  };
  const auto first = add(0);
  add(1);
  for (int i = 1; i <= kPatchedKeyframes + 2; ++i) add(0);
  for (int i = 0; i <= kPatchedKeyframes + 2; ++i) {
    EXPECT_EQ(map.keyframe({0, i}).features->patches.size(), i < 3 ? 0U : 2U) << i;
    EXPECT_EQ(map.keyframe({0, i}).features->points.size(), 2U) << i;
  }
  EXPECT_EQ(map.keyframe({1, 0}).features->patches.size(), 2U);
  EXPECT_EQ(map.keyframe({0, 0}).stamp, 0.5);
  EXPECT_EQ(first->features->patches.size(), 2U) << "who holds a keyframe keeps what it was";
}

TEST(Map, UnobserveFreesBothSides) {
  Map map;
  const KeyframeId a = add_keyframe(map, 0, 1, 0);
  const KeyframeId b = add_keyframe(map, 0, 1, 0);
  const PointId p = map.add_point(0, {});
  map.observe(p, a, 0);
  map.observe(p, b, 0);
  ASSERT_EQ(map.covisible(a, 1).size(), 1U);
  map.unobserve(p, a);
  map.unobserve(p, a);  // twice is once
  EXPECT_TRUE(map.covisible(a, 1).empty());
  EXPECT_TRUE(map.covisible(b, 1).empty());
  EXPECT_FALSE(map.point_of(a, 0).valid());
  EXPECT_TRUE(map.observe(p, a, 0));
  expect_consistent(map);
}

TEST(Map, UnknownThingsThrowAndChangeNothing) {
  Map map;
  const KeyframeId a = add_keyframe(map, 0, 1, 0);
  const PointId p = map.add_point(0, {});
  EXPECT_THROW(map.observe(p, a, 1), std::out_of_range);
  EXPECT_THROW(map.observe(p, a, -1), std::out_of_range);
  EXPECT_THROW(map.observe(p, KeyframeId{0, 9}, 0), std::out_of_range);
  EXPECT_THROW(map.observe(PointId{0, 9}, a, 0), std::out_of_range);
  EXPECT_TRUE(map.point(p).observations.empty());
  EXPECT_THROW(map.add_keyframe(nullptr, {}), std::invalid_argument);
  EXPECT_THROW(map.add_keyframe(std::make_shared<Keyframe>(), {}), std::invalid_argument);  // no id
  map.remove(PointId{0, 9});
  EXPECT_EQ(map.point_count(), 1U);
}

TEST(Map, CovisibilityStaysRightUnderRandomChanges) {
  Random random(1);
  Map map;
  std::vector<KeyframeId> keyframes;
  for (int i = 0; i < 12; ++i) keyframes.push_back(add_keyframe(map, i % 2, 30, 10));
  std::vector<PointId> points;
  std::vector<LineId> lines;
  for (int i = 0; i < 60; ++i) points.push_back(map.add_point(i % 2, {}));
  for (int i = 0; i < 20; ++i) lines.push_back(map.add_line(i % 2, {}));
  const auto pick = [&](const auto& list) {
    return list[static_cast<std::size_t>(random.integer(0, static_cast<int>(list.size()) - 1))];
  };
  for (int round = 0; round < 3000; ++round) {
    const KeyframeId k = pick(keyframes);
    const PointId p = pick(points);
    const LineId l = pick(lines);
    switch (random.integer(0, 9)) {
      case 0:
        if (map.find(p) != nullptr) map.unobserve(p, k);
        break;
      case 1:
        if (map.find(l) != nullptr) map.unobserve(l, k);
        break;
      case 2:
        if (round % 10 == 0) map.remove(p);
        break;
      case 3:
        if (round % 20 == 0) map.remove(l);
        break;
      case 4:
      case 5:
        if (map.find(l) != nullptr) map.observe(l, k, random.integer(0, 9));
        break;
      default:
        if (map.find(p) != nullptr) map.observe(p, k, random.integer(0, 29));
        break;
    }
    if (round % 250 == 0) expect_consistent(map);
  }
  expect_consistent(map);
  EXPECT_LT(map.point_count(), 60U);
  int shared = 0;
  for (KeyframeId k : keyframes) shared += static_cast<int>(map.covisible(k, 1).size());
  EXPECT_GT(shared, 20) << "the world is too empty to say anything";
}

TEST(Map, CovisibleSortsAndFallsBackToTheBest) {
  Map map;
  const KeyframeId a = add_keyframe(map, 0, 20, 0);
  const KeyframeId b = add_keyframe(map, 0, 20, 0);
  const KeyframeId c = add_keyframe(map, 0, 20, 0);
  const KeyframeId d = add_keyframe(map, 0, 20, 0);
  const KeyframeId lonely = add_keyframe(map, 0, 20, 0);
  for (int i = 0; i < 10; ++i) {
    const PointId p = map.add_point(0, {});
    map.observe(p, a, i);
    if (i < 3) map.observe(p, b, i);
    map.observe(p, c, i);
    if (i < 3) map.observe(p, d, i);
  }
  using Shared = std::vector<std::pair<KeyframeId, int>>;
  EXPECT_EQ(map.covisible(a, 1), (Shared{{c, 10}, {b, 3}, {d, 3}}));
  EXPECT_EQ(map.covisible(a, 4), (Shared{{c, 10}}));
  EXPECT_EQ(map.covisible(a, 100), (Shared{{c, 10}})) << "none share so many: those that share most";
  EXPECT_EQ(map.covisible(b, 100), (Shared{{a, 3}, {c, 3}, {d, 3}}));
  EXPECT_TRUE(map.covisible(lonely, 1).empty());
}

TEST(Map, RefreshPicksTheMedianDescriptorAndTheMeanDirection) {
  Map map;
  // Distances: 0-1: 8, 0-2: 16, 1-2: 8 bits; the middle one is the most typical. An outlier does not change
  // that.
  const std::vector<features::Descriptor256> descriptors{
      {0xFFU, 0, 0, 0}, {0, 0, 0, 0}, {0, 0xFFU, 0, 0}, {0, 0, ~0ULL, ~0ULL}};
  const std::vector<Eigen::Vector3d> centres{{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}};
  MapPoint point;
  point.position = {0, 0, 2};
  const PointId id = map.add_point(0, point);
  for (std::size_t i = 0; i < descriptors.size(); ++i) {
    auto f = std::make_shared<features::FrameFeatures>();
    f->points.resize(2);
    f->descriptors = {features::Descriptor256{}, descriptors[i]};
    f->descriptors[0].fill(0xAAAAAAAAAAAAAAAAULL);
    auto keyframe = std::make_shared<Keyframe>();
    keyframe->id = map.next_keyframe_id(0);
    keyframe->features = f;
    const KeyframeId k = map.add_keyframe(keyframe, {Eigen::Matrix3d::Identity(), -centres[i]});
    ASSERT_TRUE(map.observe(id, k, 1));
  }
  map.refresh_point(id);
  EXPECT_EQ(map.point(id).descriptor, descriptors[1]);
  EXPECT_LT((map.point(id).view_direction - Eigen::Vector3d::UnitZ()).norm(), 1e-12);
  map.unobserve(id, {0, 1});
  map.unobserve(id, {0, 2});
  map.unobserve(id, {0, 3});
  map.refresh_point(id);
  EXPECT_EQ(map.point(id).descriptor, descriptors[0]);
  EXPECT_LT((map.point(id).view_direction - Eigen::Vector3d(1, 0, 2).normalized()).norm(), 1e-12);
  map.unobserve(id, {0, 0});
  map.refresh_point(id);  // nobody sees it: stays as it is
  EXPECT_EQ(map.point(id).descriptor, descriptors[0]);
}

TEST(Map, EdgesBelongToBothEnds) {
  Map map;
  const KeyframeId a = add_keyframe(map, 0, 0, 0);
  const KeyframeId b = add_keyframe(map, 0, 0, 0);
  const KeyframeId c = add_keyframe(map, 0, 0, 0);
  SurfaceEdge edge;
  edge.a = a;
  edge.b = b;
  map.add_edge(edge);
  edge.b = c;
  map.add_edge(edge);
  ASSERT_EQ(map.edges_of(a).size(), 2U);
  EXPECT_EQ(map.edges_of(a)[1].b, c);
  EXPECT_EQ(map.edges_of(b).size(), 1U);
  edge.a = c;
  EXPECT_THROW(map.add_edge(edge), std::invalid_argument);
  edge.a = {0, 9};
  EXPECT_THROW(map.add_edge(edge), std::out_of_range);
  edge.a = c;
  edge.b = {0, 9};
  EXPECT_THROW(map.add_edge(edge), std::out_of_range);
  EXPECT_EQ(map.edges_of(c).size(), 1U) << "a refused edge leaves no trace";
}

TEST(Map, LoopsAreBetweenTwoKeyframesThatAreThere) {
  Map map;
  const KeyframeId a = add_keyframe(map, 0, 0, 0);
  const KeyframeId b = add_keyframe(map, 0, 0, 0);
  const KeyframeId c = add_keyframe(map, 0, 0, 0);
  map.set_loops({{a, b, {}, {}}, {b, c, {}, {}}, {a, c, {}, {}}});
  EXPECT_THROW(map.set_loops({{a, a, {}, {}}}), std::invalid_argument);
  EXPECT_THROW(map.set_loops({{a, {0, 9}, {}, {}}}), std::out_of_range);
  ASSERT_EQ(map.loops().size(), 3U) << "a refused loop leaves no trace";
}

TEST(Map, LandmarkIdsAreNotReusedAndRobotsCountAlone) {
  Map map;
  EXPECT_EQ(map.add_point(0, {}), (PointId{0, 0}));
  EXPECT_EQ(map.add_point(1, {}), (PointId{1, 0}));
  const PointId p = map.add_point(0, {});
  map.remove(p);
  EXPECT_EQ(map.add_point(0, {}), (PointId{0, 2}));
  MapPoint with_history;
  with_history.observations.push_back({{0, 5}, 1});
  EXPECT_TRUE(map.point(map.add_point(0, with_history)).observations.empty());
}

}  // namespace
}  // namespace plumbline::maps
