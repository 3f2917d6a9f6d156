// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "plumbline/mapping/local_mapping/keyframe_rule.hpp"

namespace plumbline::mapping {
namespace {

using geometry::Rigid3;

const sensor::Pinhole kRuleCamera{640, 480, 525.0, 525.0, 319.5, 239.5};

/// One keyframe in front of a wall 2 m away; 100 features are tracked right after it.
class Rule : public testing::Test {
 protected:
  void SetUp() override {
    auto keyframe = std::make_shared<maps::Keyframe>();
    keyframe->id = {0, 0};
    for (int v = 20; v < 480; v += 20) {
      for (int u = 20; u < 640; u += 20) {
        maps::SurfaceSample s;
        s.point = kRuleCamera.unproject(u, v, 2.0).cast<float>();
        s.normal = -Eigen::Vector3f::UnitZ();
        keyframe->surface.push_back(s);
      }
    }
    keyframe->features = std::make_shared<features::FrameFeatures>(many_features());
    map_.add_keyframe(keyframe, {});
    add_landmarks();
    rule_.keyframe_made();
  }
  static features::FrameFeatures many_features() {
    features::FrameFeatures features;
    features.points.resize(300);
    features.descriptors.resize(300);
    features.lines.resize(50);
    return features;
  }
  /// On the wall, evenly over the picture, facing the camera.
  void add_landmarks() {
    for (int i = 0; i < 300; ++i) {
      maps::MapPoint point;
      point.position = kRuleCamera.unproject(16 + 32 * (i % 20), 16 + 32 * ((i * 7) % 15), 2.0);
      point.normal = -Eigen::Vector3d::UnitZ();
      map_.observe(map_.add_point(0, point), {0, 0}, i);
    }
    for (int i = 0; i < 50; ++i) {
      maps::MapLine line;
      line.start = {0.0, 0.02 * i, 2.0};
      line.end = {0.5, 0.02 * i, 2.0};
      map_.observe(map_.add_line(0, line), {0, 0}, i);
    }
  }
  static tracking::TrackResult track(const Rigid3& pose, std::size_t points, std::size_t lines) {
    tracking::TrackResult track;
    track.min_eigenvalue = 1e6;
    track.state = tracking::TrackState::kTracked;
    track.reference = {0, 0};
    track.camera_from_world = pose;
    track.features = std::make_shared<features::FrameFeatures>();
    for (std::size_t i = 0; i < points; ++i)
      track.points.push_back({{0, static_cast<std::int32_t>(i)}, static_cast<int>(i), 0});
    for (std::size_t i = 0; i < lines; ++i)
      track.lines.push_back({{0, static_cast<std::int32_t>(i)}, static_cast<int>(i), 0});
    return track;
  }
  KeyframeDecision decide(const Rigid3& pose, std::size_t features) {
    return rule_.decide(map_, track(pose, features * 9 / 10, features - features * 9 / 10), true);
  }
  static Rigid3 moved(double x) { return {Eigen::Matrix3d::Identity(), {-x, 0.0, 0.0}}; }
  static Rigid3 turned(double yaw) { return {geometry::exp_so3({0.0, yaw, 0.0}), Eigen::Vector3d::Zero()}; }

  maps::Map map_;
  KeyframeRule rule_{{}, kRuleCamera};
};

TEST_F(Rule, StandingStillNeverMakesAKeyframe) {
  for (int i = 0; i < 300; ++i) {
    const KeyframeDecision d = decide(moved(0.001 * (i % 3)), 100);
    ASSERT_FALSE(d.wanted) << "frame " << i;
    ASSERT_FALSE(d.urgent);
    EXPECT_EQ(d.frames_since, i + 1);
  }
}

TEST_F(Rule, ParallaxFires) {
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(decide(moved(0.05), 100).wanted);
  KeyframeDecision d = decide(moved(0.2), 100);  // a tenth of the depth
  EXPECT_NEAR(d.parallax, 0.1, 0.001);
  EXPECT_FALSE(d.wanted);
  d = decide(moved(0.26), 100);
  EXPECT_NEAR(d.parallax, 0.13, 0.001);
  EXPECT_TRUE(d.wanted);
  EXPECT_FALSE(d.urgent);
}

TEST_F(Rule, RotationFires) {
  decide({}, 100);
  // A turn about the optical axis keeps overlap and parallax.
  const auto rolled = [](double angle) {
    return Rigid3(geometry::exp_so3({0.0, 0.0, angle}), Eigen::Vector3d::Zero());
  };
  EXPECT_FALSE(decide(rolled(0.24), 100).wanted);
  const KeyframeDecision d = decide(rolled(0.28), 100);
  EXPECT_NEAR(d.rotation_rad, 0.28, 1e-6);
  EXPECT_LT(d.parallax, 1e-9);
  EXPECT_TRUE(d.wanted);
}

TEST_F(Rule, LossOfFeaturesFires) {
  decide({}, 100);
  EXPECT_FALSE(decide({}, 70).wanted);
  const KeyframeDecision d = decide({}, 55);
  EXPECT_NEAR(d.shared, 0.55, 0.001);
  EXPECT_TRUE(d.wanted);
}

TEST_F(Rule, AnOlderKeyframeThatServesAsWellIsFound) {
  auto second = std::make_shared<maps::Keyframe>(map_.keyframe({0, 0}));
  second->id = {0, 1};
  map_.add_keyframe(second, moved(0.5));
  for (int i = 0; i < 200; ++i) map_.observe(core::PointId{0, i}, {0, 1}, i);
  const auto known = [&](const Rigid3& pose, std::size_t points, const KeyframeRuleOptions& options = {}) {
    auto seen = track(pose, points, 10);
    seen.reference = {0, 1};
    return KeyframeRule(options, kRuleCamera).reusable_keyframe(map_, seen);
  };
  EXPECT_EQ(known(moved(0.05), 100), (core::KeyframeId{0, 0}));
  EXPECT_FALSE(known(moved(0.22), 100).valid());  // too near to its limit
  EXPECT_FALSE(known(turned(0.24), 100).valid());
  // It must have seen what the frame sees.
  for (int i = 0; i < 60; ++i) {
    maps::MapPoint point;
    point.position = {0.01 * i, 0.0, 2.0};
    map_.observe(map_.add_point(0, point), {0, 1}, 200 + i);
  }
  auto other = track(moved(0.05), 20, 0);
  other.reference = {0, 1};
  for (std::int32_t i = 300; i < 360; ++i) other.points.push_back({{0, i}, i, 0});
  EXPECT_FALSE(KeyframeRule({}, kRuleCamera).reusable_keyframe(map_, other).valid());
  // The reference itself is no news, and who does not want it does not get it.
  EXPECT_FALSE(KeyframeRule({}, kRuleCamera).reusable_keyframe(map_, track(moved(0.05), 100, 10)).valid());
  KeyframeRuleOptions options;
  options.reuse = false;
  EXPECT_FALSE(known(moved(0.05), 100, options).valid());
}

TEST_F(Rule, LossOfSurfaceFires) {
  KeyframeRuleOptions options;
  options.max_rotation_rad = 3.0;  // only the overlap can speak
  rule_ = KeyframeRule(options, kRuleCamera);
  decide({}, 100);
  const KeyframeDecision little = decide(turned(0.2), 100);
  EXPECT_LT(little.overlap, 0.95);
  EXPECT_FALSE(little.wanted);
  const KeyframeDecision much = decide(turned(0.5), 100);
  EXPECT_LT(much.overlap, 0.7);
  EXPECT_TRUE(much.wanted);
  const KeyframeDecision behind = decide(turned(3.0), 100);
  EXPECT_EQ(behind.overlap, 0.0);
  EXPECT_TRUE(behind.urgent);
}

TEST_F(Rule, UrgentWhenTrackingIsAboutToBeLost) {
  decide({}, 100);
  const KeyframeDecision thin = decide({}, 20);
  EXPECT_TRUE(thin.urgent);
  EXPECT_TRUE(thin.wanted);
  const KeyframeDecision none = decide({}, 0);
  EXPECT_TRUE(none.urgent);
  EXPECT_EQ(none.shared, 0.0);
}

TEST_F(Rule, DepthThatIsBackIsTakenAtOnce) {
  maps::Map map;
  auto blind = std::make_shared<maps::Keyframe>(map_.keyframe({0, 0}));
  blind->surface.clear();
  map.add_keyframe(blind, {});
  const auto decide_on = [this](const maps::Map& on, int corners) {
    auto seen = track({}, 0, 0);
    auto features = many_features();
    for (int i = 0; i < corners; ++i) features.points[static_cast<std::size_t>(i)].depth = 2.0F;
    seen.features = std::make_shared<features::FrameFeatures>(features);
    return rule_.decide(on, seen, true);
  };
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(decide_on(map, 10).wanted) << "there is none yet";
  EXPECT_FALSE(decide_on(map_, 200).wanted) << "the last keyframe has a surface";
  EXPECT_TRUE(decide_on(map, 200).urgent);
  EXPECT_TRUE(decide_on(map, 200).wanted);
}

TEST_F(Rule, ASceneThatNeverHadFeaturesDoesNotFireForever) {
  for (int i = 0; i < 50; ++i) EXPECT_FALSE(decide({}, 0).wanted);
}

TEST_F(Rule, KeepsItsDistanceAndDoesNotStarve) {
  EXPECT_FALSE(decide(moved(1.0), 100).wanted) << "the very next frame";
  EXPECT_TRUE(decide(moved(1.0), 100).wanted);
  rule_.keyframe_made();
  KeyframeDecision d;
  for (int i = 1; i <= 60; ++i) {
    d = decide(moved(0.08), 100);  // slow, but moving
    EXPECT_EQ(d.wanted, i >= 60) << i;
  }
}

TEST_F(Rule, ANewKeyframeStartsTheCountAgain) {
  decide({}, 100);
  EXPECT_TRUE(decide({}, 50).wanted);
  rule_.keyframe_made();
  const KeyframeDecision first = decide({}, 50);
  EXPECT_EQ(first.frames_since, 1);
  EXPECT_DOUBLE_EQ(first.shared, 1.0) << "measured against the frame after the keyframe";
  EXPECT_FALSE(decide({}, 48).wanted);
}

TEST_F(Rule, AKeyframeWithoutDepthStillHasARule) {
  auto blind = std::make_shared<maps::Keyframe>();
  blind->id = {0, 1};
  map_.add_keyframe(blind, {});
  auto seen = track({}, 100, 0);
  seen.reference = {0, 1};
  rule_.decide(map_, seen, true);
  seen.camera_from_world = moved(0.5);
  const KeyframeDecision d = rule_.decide(map_, seen, true);
  EXPECT_EQ(d.overlap, 1.0);
  EXPECT_TRUE(std::isfinite(d.parallax));
  EXPECT_TRUE(d.wanted);
}

/// The same wall, the cone rule; 200 points and 40 lines are matched right after the keyframe.
class ConeRule : public Rule {
 protected:
  void SetUp() override {
    Rule::SetUp();
    KeyframeRuleOptions options;
    options.rule = KeyframeRuleOptions::Rule::kCone;
    rule_ = KeyframeRule(options, kRuleCamera);
    see({}, 200, 40);
  }
  /// Sideways, still looking at the same place.
  static Rigid3 around(double x) {
    return Rigid3(geometry::exp_so3({0.0, -std::atan(x / 2.0), 0.0}), Eigen::Vector3d(x, 0.0, 0.0)).inverse();
  }
  KeyframeDecision see(const Rigid3& pose, std::size_t points, std::size_t lines, bool idle = true,
                       std::size_t visible = 300) {
    tracking::TrackResult result = track(pose, points, lines);
    result.visible_points.resize(visible);
    result.visible_lines.resize(visible / 6);
    features::FrameFeatures features;
    features.points.resize(500);
    result.features = std::make_shared<features::FrameFeatures>(features);
    return rule_.decide(map_, result, idle);
  }
};

TEST_F(ConeRule, StandingStillNeverMakesAKeyframe) {
  for (int i = 0; i < 100; ++i) {
    const KeyframeDecision d = see(moved(0.001 * (i % 3)), 140, 30);
    ASSERT_FALSE(d.wanted) << i;
    EXPECT_TRUE(d.cone.candidate);
    EXPECT_LT(d.cone.now.changed, 10);
  }
}

TEST_F(ConeRule, FiresWhenTheWallIsSeenFromAnotherSide) {
  const KeyframeDecision little = see(moved(0.1), 140, 30);  // 3 degrees
  EXPECT_FALSE(little.wanted);
  EXPECT_EQ(little.cone.balance.ecog, 0.0) << "no angle has changed by 10 degrees";
  const KeyframeDecision d = see(around(0.6), 140, 30);  // 17 degrees
  EXPECT_EQ(d.cone.now.matched, 140);
  EXPECT_EQ(d.cone.now.all, 500);
  EXPECT_GT(d.cone.now.changed, d.cone.threshold.adaptive);
  EXPECT_GT(d.cone.balance.ecog, d.cone.balance.offset);
  EXPECT_TRUE(d.cone.fires);
  EXPECT_TRUE(d.wanted);
  EXPECT_FALSE(d.urgent);
}

TEST_F(ConeRule, OneSidedChangesAreNoKeyframe) {
  const KeyframeDecision d = see(moved(0.6), 140, 30);  // the wall moves out of one side of the picture
  EXPECT_GT(d.cone.now.changed, d.cone.threshold.adaptive);
  EXPECT_LT(d.cone.balance.ecog, d.cone.balance.offset);
  EXPECT_FALSE(d.wanted);
}

TEST_F(ConeRule, TurningOnTheSpotSeesNothingFromAnotherSide) {
  const KeyframeDecision d = see(turned(0.15), 140, 30);
  EXPECT_EQ(d.cone.now.changed, 0);
  EXPECT_FALSE(d.wanted);
}

TEST_F(ConeRule, ManySharedLandmarksHoldItUp) {
  const KeyframeDecision d = see(around(0.6), 180, 38);
  EXPECT_NEAR(d.cone.shared, 218.0 / 240.0, 1e-12);
  EXPECT_TRUE(d.cone.fires);
  EXPECT_FALSE(d.cone.candidate);
  EXPECT_FALSE(d.wanted);
}

TEST_F(ConeRule, ABundleUnderWayHoldsItUpForTwentyFrames) {
  KeyframeDecision d;
  for (int since = 2; since <= 21; ++since) {
    d = see(around(0.6), 140, 30, false);
    EXPECT_EQ(d.frames_since, since);
    EXPECT_EQ(d.wanted, since > 20) << since;
  }
  EXPECT_TRUE(d.cone.candidate);
}

TEST_F(ConeRule, TooFewMatchesAreNoCandidateUnlessTheSceneHasNoMore) {
  EXPECT_FALSE(see(around(0.6), 140, 8).cone.candidate) << "lines: 8 of 15, 50 in view";
  EXPECT_TRUE(see(around(0.6), 140, 8, true, 96).cone.candidate) << "16 in view: 8 will do";
  EXPECT_FALSE(see(around(0.6), 45, 20).cone.candidate) << "points: 45 of 50, 300 in view";
  EXPECT_TRUE(see(around(0.6), 45, 20, true, 90).cone.candidate);
}

TEST_F(ConeRule, AboutToBeLostIsAKeyframeWhateverTheRuleSays) {
  const KeyframeDecision d = see(moved(0.001), 20, 2, false);
  EXPECT_FALSE(d.cone.fires);
  EXPECT_FALSE(d.cone.candidate);
  EXPECT_TRUE(d.urgent);
  EXPECT_TRUE(d.wanted);
}

TEST_F(ConeRule, WithoutNormalsThePlainRuleSpeaks) {
  for (core::PointId id : map_.point_ids()) map_.point(id).normal.setZero();
  rule_.keyframe_made();
  EXPECT_EQ(see({}, 200, 40).cone.now.matched, 0);
  EXPECT_FALSE(see(moved(0.1), 200, 40).wanted);
  const KeyframeDecision d = see(moved(0.3), 200, 40);
  EXPECT_FALSE(d.cone.fires);
  EXPECT_TRUE(d.wanted) << "parallax";
}

TEST_F(ConeRule, AFewNormalsWillDo) {
  for (core::PointId id : map_.point_ids()) {
    if (id.index % 10 != 0) map_.point(id).normal.setZero();  // 20 of the 200 that are matched are left
  }
  rule_.keyframe_made();
  EXPECT_EQ(see({}, 200, 40).cone.now.matched, 20);
  EXPECT_FALSE(see(moved(0.3), 200, 40).wanted) << "parallax is the plain rule's business";
}

TEST_F(ConeRule, TellsWhatAKeyframeIsFor) {
  EXPECT_EQ(see(moved(0.001), 140, 30).cause, KeyframeCause::kNone);
  EXPECT_EQ(see(around(0.6), 140, 30).cause, KeyframeCause::kCone);
  EXPECT_EQ(see(moved(0.001), 20, 2).cause, KeyframeCause::kUrgent);
}

TEST_F(ConeRule, BalanceIsWaitedForSixFramesWhenScaled) {
  KeyframeRuleOptions options;
  options.rule = KeyframeRuleOptions::Rule::kCone;
  options.cone_scaled = true;
  rule_ = KeyframeRule(options, kRuleCamera);
  see({}, 200, 40);
  for (int i = 1; i <= 6; ++i) {
    const KeyframeDecision d = see(moved(0.6), 140, 30);  // the wall moves out of one side of the picture
    EXPECT_GT(d.cone.now.changed, d.cone.threshold.adaptive);
    EXPECT_LT(d.cone.balance.ecog, d.cone.balance.offset);
    EXPECT_EQ(d.wanted, i == 6) << i;
  }
}

TEST_F(ConeRule, UrgencyCanWaitUntilTrackingIsNearlyLost) {
  const auto urgent = [&](KeyframeRuleOptions::Urgent when, std::size_t points, std::size_t lines) {
    KeyframeRuleOptions options;
    options.rule = KeyframeRuleOptions::Rule::kCone;
    options.urgent = when;
    rule_ = KeyframeRule(options, kRuleCamera);
    see({}, 200, 40);
    return see(moved(0.001), points, lines).urgent;
  };
  using Urgent = KeyframeRuleOptions::Urgent;
  EXPECT_TRUE(urgent(Urgent::kThin, 60, 8));
  EXPECT_FALSE(urgent(Urgent::kNearlyLost, 60, 8));
  EXPECT_TRUE(urgent(Urgent::kNearlyLost, 20, 2));
  EXPECT_FALSE(urgent(Urgent::kOff, 20, 2));
}

TEST_F(ConeRule, ANewKeyframeStartsTheCountsAgain) {
  EXPECT_TRUE(see(around(0.6), 140, 30).wanted);
  rule_.keyframe_made();
  const KeyframeDecision first = see(around(0.6), 140, 30);
  EXPECT_EQ(first.frames_since, 1);
  EXPECT_DOUBLE_EQ(first.cone.shared, 1.0);
  EXPECT_EQ(first.cone.threshold.theta, 0.0);
}

}  // namespace
}  // namespace plumbline::mapping
