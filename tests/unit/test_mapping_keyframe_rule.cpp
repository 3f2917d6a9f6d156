// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "plumbline/mapping/keyframe_rule.hpp"

namespace plumbline::mapping {
namespace {

using geometry::Rigid3;

const sensor::Pinhole kCamera{640, 480, 525.0, 525.0, 319.5, 239.5};

/// One keyframe in front of a wall 2 m away; 100 features are tracked right after it.
class Rule : public testing::Test {
 protected:
  void SetUp() override {
    auto keyframe = std::make_shared<maps::Keyframe>();
    keyframe->id = {0, 0};
    for (int v = 20; v < 480; v += 20) {
      for (int u = 20; u < 640; u += 20) {
        maps::SurfaceSample s;
        s.point = kCamera.unproject(u, v, 2.0).cast<float>();
        s.normal = -Eigen::Vector3f::UnitZ();
        keyframe->surface.push_back(s);
      }
    }
    map_.add_keyframe(keyframe, {});
    rule_.keyframe_made();
  }
  KeyframeDecision decide(const Rigid3& pose, std::size_t features) {
    tracking::TrackResult track;
    track.state = tracking::TrackState::kTracked;
    track.camera_from_world = pose;
    track.points.resize(features * 9 / 10);
    track.lines.resize(features - features * 9 / 10);
    return rule_.decide(map_, {0, 0}, track, kCamera);
  }
  static Rigid3 moved(double x) { return {Eigen::Matrix3d::Identity(), {-x, 0.0, 0.0}}; }
  static Rigid3 turned(double yaw) { return {geometry::exp_so3({0.0, yaw, 0.0}), Eigen::Vector3d::Zero()}; }

  maps::Map map_;
  KeyframeRule rule_{KeyframeRuleOptions{}};
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

TEST_F(Rule, LossOfSurfaceFires) {
  KeyframeRuleOptions options;
  options.max_rotation_rad = 3.0;  // only the overlap can speak
  rule_ = KeyframeRule(options);
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
  tracking::TrackResult track;
  track.points.resize(100);
  rule_.decide(map_, {0, 1}, track, kCamera);
  track.camera_from_world = moved(0.5);
  const KeyframeDecision d = rule_.decide(map_, {0, 1}, track, kCamera);
  EXPECT_EQ(d.overlap, 1.0);
  EXPECT_TRUE(std::isfinite(d.parallax));
  EXPECT_TRUE(d.wanted);
}

}  // namespace
}  // namespace plumbline::mapping
