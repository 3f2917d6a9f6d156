// SPDX-License-Identifier: BSD-3-Clause
// Landmarks that turn out to be one, and the spanning tree.
#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>

#include "keyframe_memory.hpp"
#include "plumbline/maps/frame_pose.hpp"
#include "plumbline/maps/map.hpp"
#include "random_world.hpp"

namespace plumbline::maps {
namespace {

using geometry::Rigid3;
using tests::Random;

KeyframeId add_keyframe(Map& map, const Rigid3& pose, std::int32_t robot = 0) {
  auto features = std::make_shared<features::FrameFeatures>();
  features->points.resize(40);
  features->descriptors.resize(40);
  features->lines.resize(10);
  auto keyframe = std::make_shared<Keyframe>();
  keyframe->id = map.next_keyframe_id(robot);
  keyframe->stamp = 0.5 * keyframe->id.index;
  keyframe->features = features;
  return map.add_keyframe(keyframe, pose);
}

/// Adds `count` points that all of `keyframes` see, with their first features that are still free.
std::vector<PointId> share(Map& map, const std::vector<KeyframeId>& keyframes, int count) {
  std::vector<PointId> result;
  for (int i = 0; i < count; ++i) {
    result.push_back(map.add_point(0, {}));
    for (KeyframeId k : keyframes) {
      int feature = 0;
      while (map.point_of(k, feature).valid()) ++feature;
      map.observe(result.back(), k, feature);
    }
  }
  return result;
}

/// Every keyframe is reached from exactly one root, and parents and children agree.
void expect_tree(const Map& map, std::size_t roots) {
  std::size_t without_parent = 0;
  std::size_t children = 0;
  for (KeyframeId id : map.keyframe_ids()) {
    children += map.children(id).size();
    for (KeyframeId child : map.children(id)) {
      ASSERT_TRUE(map.has_keyframe(child));
      ASSERT_EQ(map.parent(child), id);
    }
    std::size_t steps = 0;
    KeyframeId k = id;
    for (; map.parent(k).valid(); k = map.parent(k)) {
      ASSERT_TRUE(map.has_keyframe(map.parent(k)));
      ASSERT_LE(++steps, map.keyframe_count()) << "a cycle";
    }
    without_parent += k == id ? 1U : 0U;
  }
  EXPECT_EQ(without_parent, roots);
  EXPECT_EQ(children + roots, map.keyframe_count());
}

TEST(MapTree, HangsOnWhoSharesMostOrOnTheLastOne) {
  Map map;
  const KeyframeId a = add_keyframe(map, {});
  map.attach(a);
  EXPECT_FALSE(map.parent(a).valid()) << "the first is a root";
  const KeyframeId b = add_keyframe(map, {});
  map.attach(b);
  EXPECT_EQ(map.parent(b), a) << "nothing in common: the last one";
  const KeyframeId c = add_keyframe(map, {});
  share(map, {a, c}, 5);
  share(map, {b, c}, 3);
  map.attach(c);
  EXPECT_EQ(map.parent(c), a);
  EXPECT_EQ(map.children(a), (std::vector<KeyframeId>{b, c}));
  map.attach(a);
  EXPECT_FALSE(map.parent(a).valid()) << "never on a later one";
  EXPECT_THROW(map.set_parent(a, c), std::invalid_argument) << "a cycle";
  EXPECT_THROW(map.set_parent(a, a), std::invalid_argument);
  EXPECT_THROW(map.set_parent(c, c), std::invalid_argument);
  map.set_parent(c, b);
  EXPECT_EQ(map.children(a), (std::vector<KeyframeId>{b}));
  expect_tree(map, 1);
}

TEST(FramePoses, MoveWithTheirKeyframes) {
  Random random(4);
  Map map;
  const Rigid3 pose = random.pose(1.0, 2.0);
  const Rigid3 frame_from_keyframe = random.pose(0.3, 0.2);
  const KeyframeId id = add_keyframe(map, pose);
  const std::vector<FramePose> frames{{1.1, id, frame_from_keyframe, true, {}, 0.0},
                                      {1.2, id, {}, false, {}, 0.0}};
  const Rigid3 correction = random.pose(0.5, 1.0);  // of the world
  map.set_pose(id, pose * correction);
  const geometry::Trajectory path = trajectory(frames, map);
  ASSERT_EQ(path.size(), 1U) << "where it was lost it has no pose";
  EXPECT_LT(tests::distance(path[0].world_from_camera.inverse(), frame_from_keyframe * pose * correction),
            1e-12);
  ASSERT_EQ(keyframe_trajectory(map).size(), 1U);
}

TEST(MapMerge, ObservationsAndCountsMove) {
  Map map;
  const KeyframeId a = add_keyframe(map, {});
  const KeyframeId b = add_keyframe(map, {});
  const KeyframeId c = add_keyframe(map, {});
  MapPoint made;
  made.visible = 4;
  made.found = 3;
  const PointId p = map.add_point(0, made);
  made.normal = Eigen::Vector3d::UnitX();
  const PointId q = map.add_point(0, made);
  map.observe(p, a, 0);
  map.observe(p, b, 0);
  map.observe(q, b, 1);
  map.observe(q, c, 1);
  map.merge(p, q);
  EXPECT_EQ(map.find(q), nullptr);
  EXPECT_EQ(map.point(p).observations.size(), 3U);
  EXPECT_EQ(map.point(p).visible, 8);
  EXPECT_EQ(map.point(p).found, 6);
  EXPECT_EQ(map.point(p).normal, Eigen::Vector3d::UnitX());
  EXPECT_EQ(map.point_of(c, 1), p);
  EXPECT_EQ(map.point_of(b, 0), p) << "its own feature stays";
  EXPECT_FALSE(map.point_of(b, 1).valid()) << "the other is free again";
  EXPECT_EQ(map.shared(a, c), 1);
  EXPECT_THROW(map.merge(p, p), std::invalid_argument);
  EXPECT_THROW(map.merge(p, q), std::out_of_range);
  EXPECT_EQ(map.point(p).observations.size(), 3U);

  const LineId l = map.add_line(0, {});
  const LineId m = map.add_line(0, {});
  map.observe(l, a, 0);
  map.observe(m, a, 1);
  map.observe(m, c, 1);
  map.merge(l, m);
  EXPECT_EQ(map.find(m), nullptr);
  EXPECT_EQ(map.line_of(c, 1), l);
  EXPECT_FALSE(map.line_of(a, 1).valid());
  EXPECT_THROW(map.merge(l, l), std::invalid_argument);
}

constexpr int kLines = 190;

/// What a real picture gives: 1000 corners, 190 lines with depth, small pictures, 1600 pieces of surface.
KeyframeId add_full_keyframe(Map& map) {
  auto features = std::make_shared<features::FrameFeatures>();
  features->points.resize(1000);
  features->descriptors.resize(1000);
  features->lines.resize(kLines);
  for (auto& line : features->lines) line.line3.emplace();
  features->grid = features::PointGrid(features->points, 640, 480);
  features->thumbnail.create(60, features::kThumbnailWidth, CV_32FC1);
  features->thumbnail_depth.create(60, features::kThumbnailWidth, CV_32FC1);
  auto keyframe = std::make_shared<Keyframe>();
  keyframe->id = map.next_keyframe_id(0);
  keyframe->features = features;
  keyframe->surface.resize(1600);
  return map.add_keyframe(keyframe, {});
}

TEST(MapMemory, AFullKeyframeWithItsShareOfLandmarksStaysBelowAQuarterOfAMegabyte) {
  Map map;
  std::vector<KeyframeId> keyframes;
  constexpr int kKeyframes = 12;
  for (int k = 0; k < kKeyframes; ++k) keyframes.push_back(add_full_keyframe(map));
  // All corners and lines are landmarks that four keyframes see; neighbours share and are aligned.
  for (int k = 0; k + 4 <= kKeyframes; k += 4) {
    for (int i = 0; i < 1000; ++i) {
      const PointId p = map.add_point(0, {});
      for (int j = k; j < k + 4; ++j) map.observe(p, {0, j}, i);
    }
    for (int i = 0; i < kLines; ++i) {
      const LineId l = map.add_line(0, {});
      for (int j = k; j < k + 4; ++j) map.observe(l, {0, j}, i);
    }
  }
  for (int k = 1; k < kKeyframes; ++k) {
    for (int j = std::max(0, k - 5); j < k; ++j) {
      SurfaceEdge edge;
      edge.a = {0, j};
      edge.b = {0, k};
      map.add_edge(edge);
    }
  }
  for (KeyframeId id : keyframes) {
    const tests::KeyframeMemory memory = tests::memory_of(map, id);
    EXPECT_LE(memory.total(), 250000U);
    EXPECT_GT(memory.features, 100000U) << "an estimate that forgets the features proves nothing";
    EXPECT_GT(memory.surface, 40000U);
    EXPECT_GT(memory.links, 10000U);
    EXPECT_GT(memory.landmarks, 30000U);
    EXPECT_EQ(memory.total(), memory.features + memory.surface + memory.links + memory.landmarks);
  }
}

}  // namespace
}  // namespace plumbline::maps
