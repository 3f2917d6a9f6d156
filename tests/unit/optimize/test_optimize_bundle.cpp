// SPDX-License-Identifier: BSD-3-Clause
// What a bundle makes of a map: right poses and landmarks, and what it does where little holds them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "bundle_world.hpp"

namespace plumbline::optimize {
namespace {

TEST(AdjustBundle, BringsADisturbedMapBackToTheTruth) {
  World world = make_world(noisy());
  ASSERT_GT(world.problem.point_observations.size(), 15000U);
  ASSERT_GT(world.problem.line_observations.size(), 1000U);
  const Error before = error_of(world.problem, world.truth);
  ASSERT_GT(before.metres, 0.04);
  const BundleSummary summary = adjust_bundle(world.problem, {});
  ASSERT_TRUE(summary.usable) << summary.message;
  const Error after = error_of(world.problem, world.truth);
  EXPECT_LT(after.metres, 0.002);
  EXPECT_LT(after.degrees, 0.05);
  EXPECT_LT(summary.final_cost, summary.initial_cost);
  // A tenth was wrong, and the gates let 2 % of the good ones go.
  const auto seen = static_cast<double>(world.problem.point_observations.size());
  EXPECT_NEAR(summary.point_outliers / seen, 0.118, 0.02);
  int missed = 0;
  for (std::size_t i = 0; i < world.problem.point_observations.size(); i += 10) {
    missed += world.problem.point_observations[i].outlier ? 0 : 1;
  }
  EXPECT_LT(missed, 5);
  EXPECT_LT(tests::distance(world.problem.poses[0].camera_from_world, world.truth.poses[0].camera_from_world),
            1e-15);
  std::vector<double> point_errors;
  for (std::size_t i = 0; i < world.problem.points.size(); ++i) {
    point_errors.push_back((world.problem.points[i] - world.truth.points[i]).norm());
  }
  std::nth_element(point_errors.begin(), point_errors.begin() + 1000, point_errors.end());
  EXPECT_LT(point_errors[1000], 0.008);
}

TEST(AdjustBundle, LinesHelpWherePointsAreFew) {
  double with_lines = 0.0;
  double points_only = 0.0;
  for (std::uint32_t seed = 1; seed <= 4; ++seed) {
    Scenario s = noisy();
    s.keyframes = 10;
    s.points = 15;
    s.lines = 60;
    s.seed = seed;
    World both = make_world(s);
    World points = both;
    points.problem.line_observations.clear();
    ASSERT_TRUE(adjust_bundle(both.problem, {}).usable);
    ASSERT_TRUE(adjust_bundle(points.problem, {}).usable);
    with_lines += error_of(both.problem, both.truth).metres;
    points_only += error_of(points.problem, points.truth).metres;
  }
  EXPECT_LT(with_lines, 0.7 * points_only);
}

TEST(AdjustBundle, LinesAloneHoldThePoses) {
  Scenario s = noisy();
  s.keyframes = 8;
  s.points = 0;
  s.lines = 150;
  s.wrong_every = 0;
  World world = make_world(s);
  BundleOptions options;
  options.max_iterations = 20;
  ASSERT_TRUE(adjust_bundle(world.problem, options).usable);
  EXPECT_LT(error_of(world.problem, world.truth).metres, 0.006);
}

TEST(AdjustBundle, LeavesTheOptimumAlone) {
  Scenario s;
  s.keyframes = 6;
  s.points = 200;
  s.lines = 30;
  World world = make_world(s);
  const BundleSummary summary = adjust_bundle(world.problem, {});
  ASSERT_TRUE(summary.usable);
  EXPECT_LT(summary.final_cost, 1e-9);
  EXPECT_EQ(summary.point_outliers + summary.line_outliers, 0);
  const Error after = error_of(world.problem, world.truth);
  EXPECT_LT(after.metres, 1e-7);
  EXPECT_LT(after.degrees, 1e-5);
  for (std::size_t i = 0; i < world.truth.points.size(); ++i) {
    EXPECT_LT((world.problem.points[i] - world.truth.points[i]).norm(), 1e-7);
  }
}

TEST(AdjustBundle, OneKeyframeMovesItsPointsToTheirMeasurements) {
  Scenario s;
  s.keyframes = 1;
  s.points = 40;
  s.lines = 5;
  s.landmark_error_m = 0.05;
  World world = make_world(s);
  const BundleSummary summary = adjust_bundle(world.problem, {});
  ASSERT_TRUE(summary.usable) << summary.message;
  for (const BundlePointObservation& o : world.problem.point_observations) {
    const auto i = static_cast<std::size_t>(o.point);
    EXPECT_LT((world.problem.points[i] - world.truth.points[i]).norm(), 1e-3);
  }
}

TEST(AdjustBundle, CollinearPointsWithoutDepthStayFinite) {
  Scenario s;
  s.keyframes = 4;
  s.points = 0;
  s.lines = 0;
  World world = make_world(s);
  Random random(3);
  for (int i = 0; i < 12; ++i) {
    world.problem.points.emplace_back(0.1 * i - 0.6, 0.0, 2.5);
    for (int k = 0; k < 4; ++k) see_point(s, random, world.problem, k, i);
  }
  for (auto& o : world.problem.point_observations) o.depth = 0.0;
  for (std::size_t k = 1; k < 4; ++k) {
    auto& pose = world.problem.poses[k].camera_from_world;
    pose = random.step(0.02, 0.02) * pose;
  }
  const BundleSummary summary = adjust_bundle(world.problem, {});
  EXPECT_TRUE(finite(world.problem));
  EXPECT_LE(summary.final_cost, summary.initial_cost);
  for (const BundlePose& pose : world.problem.poses)
    EXPECT_LT(pose.camera_from_world.translation.norm(), 5.0);
}

TEST(AdjustBundle, StrangeLinesSurviveAndHurtNobody) {
  Scenario s = noisy();
  s.keyframes = 6;
  s.points = 300;
  s.lines = 20;
  World world = make_world(s);
  BundleLineObservation seen;
  seen.start = {100, 100};
  seen.end = {500, 300};
  // Through the centre of camera 0 (held, so that it stays there until the line itself moves).
  world.problem.lines.push_back(
      geometry::line_through(world.truth.poses[0].camera_from_world.inverse().translation, {0.3, 0.2, 3.0}));
  seen.line = 20;
  seen.pose = 0;
  world.problem.line_observations.push_back(seen);
  world.problem.lines.push_back(
      {1e12 * Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY()});  // (almost) at infinity
  seen.line = 21;
  seen.pose = 2;
  world.problem.line_observations.push_back(seen);
  seen.pose = 3;
  world.problem.line_observations.push_back(seen);
  world.problem.lines.push_back(
      {Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitZ()});  // through the world's origin
  seen.line = 22;
  world.problem.line_observations.push_back(seen);
  const BundleSummary summary = adjust_bundle(world.problem, {});
  ASSERT_TRUE(summary.usable) << summary.message;
  EXPECT_TRUE(finite(world.problem));
  EXPECT_LT(error_of(world.problem, world.truth).metres, 0.004);
}

TEST(AdjustBundle, ALineWithoutAnImageIsAnOutlier) {
  Scenario s;
  s.keyframes = 2;
  s.points = 100;
  s.lines = 0;
  World world = make_world(s);
  const Rigid3 world_from_camera = world.truth.poses[0].camera_from_world.inverse();
  world.problem.lines.push_back(geometry::line_through(world_from_camera.translation, {0.3, 0.2, 3.0}));
  BundleLineObservation seen;
  seen.pose = 0;
  seen.line = 0;
  seen.start = {100, 100};
  seen.end = {500, 300};
  world.problem.line_observations.push_back(seen);
  const BundleSummary summary = adjust_bundle(world.problem, {});
  ASSERT_TRUE(summary.usable);
  EXPECT_EQ(summary.line_outliers, 1);
}

/// Poses alone.
World bare_world(int keyframes, double pose_error_m, double pose_error_rad) {
  Scenario s;
  s.keyframes = keyframes;
  s.points = 0;
  s.lines = 0;
  s.pose_error_m = pose_error_m;
  s.pose_error_rad = pose_error_rad;
  return make_world(s);
}

TEST(AdjustBundle, EdgesAloneHoldPosesAndFreeDirectionsStay) {
  World world = bare_world(5, 0.05, 0.03);
  for (int i = 0; i + 1 < 5; ++i) {
    const auto a = static_cast<std::size_t>(i);
    world.problem.edges.push_back(
        {i, i + 1,
         world.truth.poses[a + 1].camera_from_world * world.truth.poses[a].camera_from_world.inverse(),
         1e4 * geometry::Matrix6d::Identity()});
  }
  BundleProblem weak = world.problem;
  BundleOptions options;
  options.max_iterations = 30;
  const BundleSummary summary = adjust_bundle(world.problem, options);
  ASSERT_TRUE(summary.usable) << summary.message;
  EXPECT_LT(error_of(world.problem, world.truth).metres, 1e-4);

  // An edge that knows nothing of sliding along x leaves that as it was.
  weak.poses.resize(2);
  weak.edges.resize(1);
  weak.edges[0].information.row(0).setZero();
  weak.edges[0].information.col(0).setZero();
  const auto slide = [&](const BundleProblem& p) {
    const Rigid3 b_from_a = p.poses[1].camera_from_world * p.poses[0].camera_from_world.inverse();
    return geometry::log_se3(b_from_a * weak.edges[0].b_from_a.inverse());
  };
  const geometry::Vector6d before = slide(weak);
  ASSERT_TRUE(adjust_bundle(weak, options).usable);
  const geometry::Vector6d after = slide(weak);
  EXPECT_LT(after.tail<5>().norm(), 1e-4);
  EXPECT_NEAR(after(0), before(0), 0.01);
}

TEST(AdjustBundle, AWideFirstRegionMovesManyTogetherInFewIterations) {
  // Thirty keyframes that hold each other firmly hang on the first one by a weaker edge: only all
  // together they can follow it.
  World world = bare_world(31, 0.0, 0.0);
  constexpr double kAsk_m = 0.05;
  for (std::size_t i = 0; i + 1 < world.problem.poses.size(); ++i) {
    Rigid3 b_from_a =
        world.truth.poses[i + 1].camera_from_world * world.truth.poses[i].camera_from_world.inverse();
    if (i == 0) b_from_a.translation.x() += kAsk_m;
    world.problem.edges.push_back({static_cast<int>(i), static_cast<int>(i) + 1, b_from_a,
                                   (i == 0 ? 1e4 : 1e8) * geometry::Matrix6d::Identity()});
  }
  const auto moved_m = [&](double first_radius) {
    BundleProblem problem = world.problem;
    BundleOptions options;
    options.max_iterations = 3;
    options.rounds = 1;
    options.tolerance = 0.0;
    options.first_radius = first_radius;
    EXPECT_TRUE(adjust_bundle(problem, options).usable);
    return (problem.poses.back().camera_from_world.inverse().translation -
            world.truth.poses.back().camera_from_world.inverse().translation)
        .norm();
  };
  EXPECT_NEAR(moved_m(1e7), kAsk_m, 0.02 * kAsk_m);
  EXPECT_LT(moved_m(1e4), 0.5 * kAsk_m);
}

}  // namespace
}  // namespace plumbline::optimize
