// SPDX-License-Identifier: BSD-3-Clause
// A robot whose path has drifted learns of it by way of another robot's map of the two ends.
#include <gtest/gtest.h>

#include "plumbline/mapping/loop_closing/loop_closer.hpp"
#include "plumbline/maps/map_join.hpp"
#include "poster_view.hpp"

namespace plumbline::mapping {
namespace {

using core::KeyframeId;
using geometry::Rigid3;
using tests::kTestCamera;

constexpr double kDrift_m = 0.15;  // on 7 m of way: up to 0.24 m would be believed
const Rigid3 kOwnFromOther(geometry::exp_so3({0.0, 0.03, 0.0}), {0.1, 0.0, -0.05});  // as the hub believes

LoopOptions options_for_few() {
  LoopOptions options;
  options.places.consistent = 1;
  options.bundle = false;
  return options;
}

/// A robot that films posters along a wall, 3 m apart, two views of each.
class Robot {
 public:
  /// The map believes the poster to be `believed_m` along the wall. What comes of the second view, if there
  /// is a closer.
  std::vector<Loop> see(std::uint32_t poster, double believed_m, LoopCloser* closer) {
    std::vector<Loop> loops;
    for (const Rigid3& view : {Rigid3(geometry::exp_so3({0.0, 0.05, 0.0}), {0.15, 0.0, 0.0}),
                               Rigid3(geometry::exp_so3({0.02, -0.05, 0.1}), {-0.1, 0.05, 0.1})}) {
      const Rigid3 place_from_world(Eigen::Matrix3d::Identity(), {-believed_m, 0.0, 0.0});
      const KeyframeId id =
          tests::add_view(map, tests::poster(1200, poster), view, view * place_from_world, stamp_);
      stamp_ += 2.0;
      if (closer != nullptr) loops = closer->detect(map, id);
    }
    return loops;
  }
  maps::Map map;

 private:
  double stamp_ = 0.0;
};

/// The other one was at all places and nowhere else; its map is true.
std::shared_ptr<const OtherMapsInbox> told_of_another(const std::vector<std::uint32_t>& posters) {
  Robot other;
  for (std::size_t i = 0; i < posters.size(); ++i)
    other.see(posters[i], 3.0 * static_cast<double>(i), nullptr);
  auto told = std::make_shared<OtherMaps>();
  const maps::Map renumbered = maps::renumbered(other.map, {{0, 1}});
  told->map = maps::joined({&renumbered}, {kOwnFromOther});
  told->cameras = {{1, kTestCamera}};
  auto inbox = std::make_shared<OtherMapsInbox>();
  inbox->put(told);
  return inbox;
}

/// Sees poster 5, then what nobody else has seen, then poster 7, which it believes to be further than it is.
std::vector<Loop> drive(Robot& own, LoopCloser& closer) {
  own.see(5, 0.0, &closer);
  own.see(20, 3.0, &closer);
  own.see(21, 4.5 + 0.5 * kDrift_m, &closer);
  return own.see(7, 6.0 + kDrift_m, &closer);
}

double last_x(const Robot& own) {
  const KeyframeId id = own.map.keyframe_ids().back();
  return own.map.camera_from_world(id).inverse().translation.x();
}

TEST(InterRobotLoops, DriftIsTakenOutByWayOfAnothersMap) {
  LoopCloser closer(options_for_few(), kTestCamera);
  closer.use(told_of_another({5, 6, 7}));
  Robot own;
  const std::vector<Loop> loops = drive(own, closer);
  ASSERT_FALSE(loops.empty());
  for (const Loop& loop : loops) {
    EXPECT_LT(loop.match.index, 2);
    EXPECT_GE(loop.query.index, 6);
    EXPECT_EQ(loop.match.robot, 0);
  }
  const std::size_t keyframes = own.map.keyframe_count();
  const double before = last_x(own);
  std::vector<PoseEdge> edges;
  for (const Loop& loop : loops) edges.push_back(LoopCloser::to_edge(loop));
  ASSERT_TRUE(closer.close(own.map, edges));
  EXPECT_NEAR(before - last_x(own), kDrift_m, 0.05);
  EXPECT_EQ(closer.counts().by_others, static_cast<int>(loops.size()));
  EXPECT_EQ(own.map.keyframe_count(), keyframes) << "nothing of the other's map enters its own";
  for (const KeyframeId id : own.map.keyframe_ids()) EXPECT_EQ(id.robot, 0);
}

TEST(InterRobotLoops, WithoutAnothersMapNothingIsKnown) {
  LoopCloser alone(options_for_few(), kTestCamera);
  Robot own;
  EXPECT_TRUE(drive(own, alone).empty());
  LoopCloser strangers(options_for_few(), kTestCamera);
  strangers.use(told_of_another({30, 31, 32}));
  Robot another;
  EXPECT_TRUE(drive(another, strangers).empty());
  LoopCloser early(options_for_few(), kTestCamera);
  early.use(std::make_shared<OtherMapsInbox>());
  Robot third;
  EXPECT_TRUE(drive(third, early).empty()) << "nothing has come yet";
}

TEST(InterRobotLoops, WhatAgreesIsNotClosed) {
  LoopCloser closer(options_for_few(), kTestCamera);
  closer.use(told_of_another({5, 6, 7}));
  Robot own;
  own.see(5, 0.0, &closer);
  own.see(20, 3.0, &closer);
  EXPECT_TRUE(own.see(7, 6.0, &closer).empty());
}

TEST(InterRobotLoops, WhatNoDriftExplainsIsRefused) {
  LoopCloser closer(options_for_few(), kTestCamera);
  closer.use(told_of_another({5, 6, 7}));
  Robot own;
  own.see(5, 0.0, &closer);
  own.see(20, 3.0, &closer);
  EXPECT_TRUE(own.see(7, 7.5, &closer).empty());
  ASSERT_FALSE(closer.trials().empty());
  EXPECT_TRUE(closer.trials().back().by_others);
  EXPECT_NE(closer.trials().back().refused.find("drift"), std::string::npos)
      << closer.trials().back().refused;
}

}  // namespace
}  // namespace plumbline::mapping
