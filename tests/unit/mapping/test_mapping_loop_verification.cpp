// SPDX-License-Identifier: BSD-3-Clause
// Places are verified, and only those that are the same; loops that are wrong do no harm.
#include <gtest/gtest.h>

#include "plumbline/mapping/loop_closing/loop_closer.hpp"
#include "plumbline/mapping/merging/map_fusion.hpp"
#include "poster_view.hpp"

namespace plumbline::mapping {
namespace {

using core::KeyframeId;
using geometry::Rigid3;
using tests::add_view;
using tests::kTestCamera;

const Rigid3 kLeft{geometry::exp_so3({0.0, 0.05, 0.0}), {0.15, 0.0, 0.0}};
const Rigid3 kRight{geometry::exp_so3({0.02, -0.05, 0.1}), {-0.1, 0.05, 0.1}};

TEST(PlaceVerification, FindsThePoseWhateverTheMapBelieves) {
  maps::Map map;
  const cv::Mat poster = tests::poster(1200, 5);
  const Rigid3 drift(geometry::exp_so3({0.0, 0.0, 0.3}), {1.0, -2.0, 0.5});
  const KeyframeId match = add_view(map, poster, kLeft, kLeft, 0.0);
  const KeyframeId query = add_view(map, poster, kRight, kRight * drift, 20.0);
  const PlaceVerification v = verify_place({&map, query, kTestCamera}, {&map, match, kTestCamera}, {}, 1);
  ASSERT_TRUE(v.accepted) << v.refused;
  const Rigid3 truth = kRight * kLeft.inverse();
  EXPECT_LT(tests::distance(v.query_from_match, truth), 0.02);
  EXPECT_LT(tests::angle(v.query_from_match, truth), 0.01);
  EXPECT_GT(v.overlap, 0.8);
  EXPECT_LT(v.contradiction, 0.02);
  EXPECT_GE(v.cells, 10);
}

TEST(PlaceVerification, PoseAndStructureTogetherStandNoLandmarksThatAreOff) {
  maps::Map map;
  const cv::Mat poster = tests::poster(1200, 5);
  const KeyframeId match = add_view(map, poster, kLeft, kLeft, 0.0);
  const KeyframeId query = add_view(map, poster, kRight, kRight, 20.0);
  VerificationOptions joint;
  joint.joint = true;
  joint.align = false;
  joint.depth_rows = false;
  const PlaceVerification v = verify_place({&map, query, kTestCamera}, {&map, match, kTestCamera}, joint, 1);
  ASSERT_TRUE(v.accepted) << v.refused;
  EXPECT_FALSE(v.surface_aligned);
  const Rigid3 truth = kRight * kLeft.inverse();
  EXPECT_LT(tests::distance(v.query_from_match, truth), 0.02);
  EXPECT_LT(tests::angle(v.query_from_match, truth), 0.01);
}

TEST(PlaceVerification, SameSeedSameAnswer) {
  maps::Map map;
  const cv::Mat poster = tests::poster(1200, 5);
  const KeyframeId match = add_view(map, poster, kLeft, kLeft, 0.0);
  const KeyframeId query = add_view(map, poster, kRight, kRight, 20.0);
  const PlaceVerification a = verify_place({&map, query, kTestCamera}, {&map, match, kTestCamera}, {}, 7);
  const PlaceVerification b = verify_place({&map, query, kTestCamera}, {&map, match, kTestCamera}, {}, 7);
  EXPECT_EQ(a.query_from_match.translation, b.query_from_match.translation);
  EXPECT_EQ(a.points, b.points);
}

TEST(PlaceVerification, RefusesAnotherPosterAndNoFeatures) {
  maps::Map map;
  const KeyframeId match = add_view(map, tests::poster(1200, 5), kLeft, kLeft, 0.0);
  const KeyframeId other = add_view(map, tests::poster(1200, 99), kRight, kRight, 20.0);
  const PlaceVerification v = verify_place({&map, other, kTestCamera}, {&map, match, kTestCamera}, {}, 1);
  EXPECT_FALSE(v.accepted);
  EXPECT_FALSE(v.refused.empty());
  const KeyframeId white = add_view(map, cv::Mat(1200, 1200, CV_8UC1, cv::Scalar(90)), kLeft, kLeft, 30.0);
  EXPECT_FALSE(verify_place({&map, white, kTestCamera}, {&map, match, kTestCamera}, {}, 1).accepted);
  EXPECT_FALSE(verify_place({&map, match, kTestCamera}, {&map, white, kTestCamera}, {}, 1).accepted);
}

/// A way round a circle whose estimate drifts; the last keyframe is where the first is.
struct Ring {
  static constexpr int kCount = 40;
  maps::Map map;
  std::vector<Rigid3> truth;

  /// `turn`: rad that the estimate turns too far at each keyframe.
  explicit Ring(double turn = 0.005, int features = 0) {
    constexpr double kTurn = 6.283185307 / (kCount - 1);
    const Rigid3 step(geometry::exp_so3({0.0, kTurn, 0.0}), {0.3, 0.0, 0.0});
    const Rigid3 wrong_step(geometry::exp_so3({0.001, kTurn + turn, 0.0005}), {0.303, 0.002, 0.001});
    Rigid3 pose;
    Rigid3 believed;
    for (int i = 0; i < kCount; ++i) {
      truth.push_back(pose);
      auto keyframe = std::make_shared<maps::Keyframe>();
      keyframe->id = {0, i};
      keyframe->stamp = i;
      auto picture = std::make_shared<features::FrameFeatures>();
      picture->points.resize(static_cast<std::size_t>(features));
      picture->descriptors.resize(static_cast<std::size_t>(features));
      keyframe->features = picture;
      map.add_keyframe(keyframe, believed);
      map.attach(keyframe->id);
      pose = step * pose;
      believed = wrong_step * believed;
    }
  }
  [[nodiscard]] PoseEdge edge(int a, int b) const {
    const auto i = static_cast<std::size_t>(a);
    const auto j = static_cast<std::size_t>(b);
    return {{0, a}, {0, b}, truth[j] * truth[i].inverse(), 1e4 * geometry::Matrix6d::Identity(), false};
  }
  [[nodiscard]] double worst() const {
    double result = 0.0;
    for (int i = 0; i < kCount; ++i) {
      result = std::max(result,
                        tests::distance(map.camera_from_world({0, i}), truth[static_cast<std::size_t>(i)]));
    }
    return result;
  }
};

LoopOptions without_bundle() {
  LoopOptions options;
  options.bundle = false;
  return options;
}

TEST(LoopCloser, TakesTheDriftOut) {
  Ring ring;
  const double before = ring.worst();
  LoopCloser closer(without_bundle(), kTestCamera);
  EXPECT_TRUE(closer.close(ring.map, {ring.edge(0, 39), ring.edge(1, 38)}));
  EXPECT_LT(ring.worst(), 0.5 * before);
  EXPECT_EQ(closer.counts().accepted, 1);
  EXPECT_EQ(ring.map.loops().size(), 2U);
}

TEST(LoopCloser, LoopsOfTheMapHoldWhoeverClosedThem) {
  Ring ring;
  LoopCloser first(without_bundle(), kTestCamera);
  ASSERT_TRUE(first.close(ring.map, {ring.edge(0, 39), ring.edge(1, 38), ring.edge(2, 37)}));
  LoopCloser second(without_bundle(), kTestCamera);  // of a run that goes on
  second.restore(ring.map, {0, 39});
  PoseEdge wrong = ring.edge(3, 36);
  wrong.b_from_a = Rigid3(geometry::exp_so3({0.0, 0.3, 0.0}), {0.5, -0.3, 0.4}) * wrong.b_from_a;
  EXPECT_FALSE(second.close(ring.map, {wrong}));
  EXPECT_EQ(ring.map.loops().size(), 3U);
  EXPECT_TRUE(second.close(ring.map, {ring.edge(4, 35)}));
  EXPECT_EQ(ring.map.loops().size(), 4U);
  EXPECT_EQ(loop_edges(ring.map).size(), 4U);

  const maps::Map other = renumbered(ring.map, {{0, 3}});
  ASSERT_EQ(other.loops().size(), 4U);
  EXPECT_EQ(other.loops()[3].a, (core::KeyframeId{3, 4}));
  EXPECT_EQ(other.loops()[3].b, (core::KeyframeId{3, 35}));
  EXPECT_EQ(other.loops()[3].b_from_a.translation, ring.map.loops()[3].b_from_a.translation);
  const maps::Map both = maps::joined({&ring.map, &other}, {Rigid3{}, Rigid3{}});
  EXPECT_EQ(both.loops().size(), 8U);
}

TEST(LoopCloser, WrongLoopsAmongRightOnesDoNoHarm) {
  std::vector<PoseEdge> right;
  Ring clean;
  for (int i = 0; i < 7; ++i) right.push_back(clean.edge(i, 39 - i));
  LoopCloser alone(without_bundle(), kTestCamera);
  ASSERT_TRUE(alone.close(clean.map, right));

  Ring forced;  // 30 % of the edges are wrong
  std::vector<PoseEdge> all = right;
  for (const auto& [a, b] : {std::pair{3, 20}, std::pair{8, 30}, std::pair{12, 25}}) {
    PoseEdge wrong = forced.edge(a, b);
    wrong.b_from_a = Rigid3(geometry::exp_so3({0.3, 0.8, -0.2}), {0.5, -0.7, 1.0});
    all.push_back(wrong);
  }
  LoopCloser robust(without_bundle(), kTestCamera);
  ASSERT_TRUE(robust.close(forced.map, all));
  EXPECT_EQ(robust.counts().rejected, 3);
  EXPECT_LE(forced.worst(), 1.1 * clean.worst());

  Ring harmed;
  LoopOptions believing = without_bundle();
  believing.robust = false;
  LoopCloser gullible(believing, kTestCamera);
  gullible.close(harmed.map, all);
  EXPECT_GT(harmed.worst(), 1.5 * forced.worst()) << "the test's wrong edges must be harmful";
}

/// Keyframes that share landmarks with the six before them, as the map of a real camera does.
void tie_neighbours(maps::Map& map, int count) {
  constexpr int kShared = 40;
  for (int i = 0; i < count; ++i) {
    for (int k = 0; k < kShared; ++k) {
      const core::PointId point = map.add_point(0, {});
      for (int j = i; j < std::min(count, i + 6); ++j) map.observe(point, {0, j}, kShared * (i % 6) + k);
    }
  }
}

TEST(LoopCloser, DriftThatGoesOneWayIsNoReasonToRefuseALoop) {
  for (const double turn : {0.0, 0.004, 0.008}) {  // rad a keyframe, always the same way
    Ring ring(turn, 240);
    tie_neighbours(ring.map, Ring::kCount);
    const double before = ring.worst();
    LoopCloser closer(without_bundle(), kTestCamera);
    EXPECT_TRUE(closer.close(ring.map, {ring.edge(0, 39), ring.edge(1, 38)})) << turn;
    EXPECT_EQ(closer.counts().rejected, 0) << turn;
    EXPECT_LT(ring.worst(), 0.5 * before) << turn;
    // A wrong one is told from right ones all the same.
    PoseEdge wrong = ring.edge(2, 37);
    wrong.b_from_a = Rigid3(Eigen::Matrix3d::Identity(), {0.5, 0.0, 0.3}) * wrong.b_from_a;
    EXPECT_FALSE(closer.close(ring.map, {wrong})) << turn;
  }
}

TEST(LoopCloser, WrongLoopsAmongRightOnesDoNoHarmToAMapThatDrifts) {
  std::vector<PoseEdge> right;
  Ring clean(0.006, 240);
  tie_neighbours(clean.map, Ring::kCount);
  for (int i = 0; i < 7; ++i) right.push_back(clean.edge(i, 39 - i));
  LoopCloser alone(without_bundle(), kTestCamera);
  ASSERT_TRUE(alone.close(clean.map, right));
  ASSERT_EQ(alone.counts().rejected, 0);
  std::vector<PoseEdge> all = right;
  for (const auto& [a, b] : {std::pair{3, 20}, std::pair{8, 30}, std::pair{12, 25}}) {
    // The same place, as the look-alikes of a corridor say.
    all.push_back({{0, a},
                   {0, b},
                   Rigid3(geometry::exp_so3({0.0, 0.2, 0.0}), {0.2, 0.0, -0.3}),
                   right.front().information,
                   false});
  }
  Ring forced(0.006, 240);
  tie_neighbours(forced.map, Ring::kCount);
  LoopCloser robust(without_bundle(), kTestCamera);
  ASSERT_TRUE(robust.close(forced.map, all));
  EXPECT_EQ(robust.counts().rejected, 3);
  EXPECT_LE(forced.worst(), 1.1 * clean.worst());
}

TEST(LoopCloser, OnlyWrongLoopsChangeNothing) {
  Ring ring;
  const double before = ring.worst();
  PoseEdge wrong = ring.edge(5, 25);
  wrong.b_from_a = Rigid3(geometry::exp_so3({2.0, 0.0, 0.0}), {8.0, 9.0, 10.0});
  LoopCloser closer(without_bundle(), kTestCamera);
  EXPECT_FALSE(closer.close(ring.map, {wrong}));
  EXPECT_EQ(ring.worst(), before);
  EXPECT_FALSE(closer.close(ring.map, {}));
}

}  // namespace
}  // namespace plumbline::mapping
