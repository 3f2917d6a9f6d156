// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "landmark_world.hpp"
#include "plumbline/maps/components.hpp"

namespace plumbline::maps {
namespace {

using geometry::Rigid3;
using tests::LandmarkWorld;

/// Two components of three keyframes: of the first six landmarks, and of the others.
struct TwoComponents {
  LandmarkWorld world{3, 12, 4};
  std::vector<core::KeyframeId> keyframes;
  std::vector<FramePose> frames;

  TwoComponents() {
    for (int i = 0; i < 6; ++i) {
      keyframes.push_back(world.add_keyframe(tests::looking_from(0.1 * i)));
      FramePose frame;
      frame.stamp = 0.1 * i;
      frame.tracked = true;
      frame.reference = keyframes.back();
      frames.push_back(frame);
    }
    const std::vector<core::KeyframeId> first(keyframes.begin(), keyframes.begin() + 3);
    const std::vector<core::KeyframeId> second(keyframes.begin() + 3, keyframes.end());
    for (std::size_t i = 0; i < 12; ++i) world.add_point(i, i < 6 ? first : second);
    for (std::size_t i = 0; i < 4; ++i) world.add_line(i, i < 2 ? first : second);

    // add_keyframe() hung the fourth on the third: as parts of a map that never had this.
    const MapChanges whole = world.map.changes_since({});
    MapParts parts;
    parts.keyframes = whole.keyframes;
    parts.keyframes[3].parent = {};
    for (const auto& page : whole.points)
      parts.points.insert(parts.points.end(), page.landmarks.begin(), page.landmarks.end());
    for (const auto& page : whole.lines)
      parts.lines.insert(parts.lines.end(), page.landmarks.begin(), page.landmarks.end());
    parts.next = whole.next;
    world.map = Map(parts);
  }
};

TEST(Components, EachTreeIsOne) {
  const TwoComponents two;
  const Map& map = two.world.map;
  EXPECT_EQ(roots(map), (std::vector<core::KeyframeId>{two.keyframes[0], two.keyframes[3]}));
  EXPECT_EQ(root_of(map, two.keyframes[2]), two.keyframes[0]);
  EXPECT_EQ(root_of(map, two.keyframes[5]), two.keyframes[3]);
}

TEST(Components, OneAsAMapOfItsOwnKeepsItsIds) {
  const TwoComponents two;
  const Map own = component(two.world.map, two.keyframes[3]);
  EXPECT_EQ(own.keyframe_ids(),
            (std::vector<core::KeyframeId>{two.keyframes[3], two.keyframes[4], two.keyframes[5]}));
  EXPECT_EQ(own.point_count(), 6U);
  EXPECT_EQ(own.line_count(), 2U);
  EXPECT_EQ(own.next_keyframe_id(0), two.world.map.next_keyframe_id(0));
  for (const core::PointId id : own.point_ids())
    EXPECT_EQ(own.point(id).position, two.world.map.point(id).position);
}

TEST(Components, OneMovesWithItsLandmarksAndTheOtherStays) {
  TwoComponents two;
  const Map before = two.world.map;
  const Rigid3 turned(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitY()).toRotationMatrix(),
                      Eigen::Vector3d(1.0, 2.0, 3.0));
  move_component(two.world.map, two.keyframes[3], turned);
  const Map& after = two.world.map;
  for (const core::PointId id : after.point_ids()) {
    const core::KeyframeId by = after.point(id).observations.front().keyframe;
    const Eigen::Vector3d in_camera = after.camera_from_world(by) * after.point(id).position;
    EXPECT_LT((in_camera - before.camera_from_world(by) * before.point(id).position).norm(), 1e-12);
    const bool moved = (after.point(id).position - before.point(id).position).norm() > 0.5;
    EXPECT_EQ(moved, root_of(after, by) == two.keyframes[3]);
  }
}

TEST(Components, FramesKeepTheirNumbersAndTheLargerOneIsMain) {
  TwoComponents two;
  two.frames[1].tracked = false;
  EXPECT_EQ(main_root(two.world.map, two.frames), two.keyframes[3]);
  const Map own = component(two.world.map, two.keyframes[0]);
  const std::vector<FramePose> frames = frames_in(own, two.frames);
  ASSERT_EQ(frames.size(), 6U);
  for (std::size_t i = 0; i < frames.size(); ++i) EXPECT_EQ(frames[i].tracked, i == 0 || i == 2) << i;
}

TEST(Components, OneIsCutInTwo) {
  LandmarkWorld world(3, 12, 4);
  std::vector<core::KeyframeId> keyframes;
  for (int i = 0; i < 6; ++i) keyframes.push_back(world.add_keyframe(tests::looking_from(0.1 * i)));
  const std::vector<core::KeyframeId> late(keyframes.begin() + 3, keyframes.end());
  for (std::size_t i = 0; i < 12; ++i) world.add_point(i, i < 6 ? keyframes : late);
  for (std::size_t i = 0; i < 4; ++i) world.add_line(i, i < 2 ? keyframes : late);
  Map& map = world.map;
  SurfaceEdge edge;
  edge.a = keyframes[2];
  edge.b = keyframes[3];
  edge.information.setIdentity();
  map.add_edge(edge);
  map.set_loops({{keyframes[0], keyframes[5], {}, edge.information},
                 {keyframes[0], keyframes[2], {}, edge.information}});

  split_component(map, keyframes[3]);
  EXPECT_EQ(roots(map), (std::vector<core::KeyframeId>{keyframes[0], keyframes[3]}));
  EXPECT_EQ(root_of(map, keyframes[5]), keyframes[3]);
  for (const core::KeyframeId id : late) EXPECT_EQ(map.points_seen_by({id}).size(), 6U);
  EXPECT_EQ(map.points_seen_by({keyframes[0]}).size(), 6U);
  EXPECT_EQ(component(map, keyframes[3]).line_count(), 2U);
  ASSERT_EQ(map.loops().size(), 1U);
  EXPECT_EQ(map.loops().front().b, keyframes[2]);
  EXPECT_TRUE(map.edges().begin()->second.information.isZero());

  split_component(map, keyframes[3]);
  EXPECT_EQ(roots(map).size(), 2U);
}

}  // namespace
}  // namespace plumbline::maps
