// SPDX-License-Identifier: BSD-3-Clause
// How a bundle is solved, by our own solver and by Ceres: against Ceres with derivatives that it finds
// itself, the same bytes wherever the heap puts things, and what it tells.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "bundle_world.hpp"
#include "ceres_bundle.hpp"
#include "shuffled_heap.hpp"

namespace plumbline::optimize {
namespace {

constexpr BundleSummary (*kSolvers[])(BundleProblem&, const BundleOptions&) = {adjust_bundle,
                                                                               adjust_map_bundle};

TEST(AdjustBundle, TellsHowWellAllFitsBeforeAndAfter) {
  Scenario s = noisy();
  s.pose_error_m = 0.005;
  s.pose_error_rad = 0.002;
  s.landmark_error_m = 0.004;
  World world = make_world(s);
  World plain = world;
  BundleOptions options;
  options.first_gate = 3.0;
  const BundleSummary summary = adjust_bundle(world.problem, options);
  ASSERT_TRUE(summary.usable) << summary.message;
  const BundleFit& points = summary.after.points;
  EXPECT_EQ(points.all, world.problem.point_observations.size());
  EXPECT_EQ(points.all, points.fitting + static_cast<std::size_t>(summary.point_outliers));
  EXPECT_EQ(summary.after.lines.all, world.problem.line_observations.size());
  EXPECT_EQ(summary.after.edges.all, world.problem.edges.size());
  // Noise of one standard deviation without what lies beyond the gate is 0.957; of its three rows each, three
  // for every point went into where the points lie.
  const auto unknowns = static_cast<double>(world.problem.points.size());
  EXPECT_NEAR(points.rms, 0.957 * std::sqrt(1.0 - unknowns / static_cast<double>(points.fitting)), 0.015);
  EXPECT_EQ(summary.before.points.all, points.all);
  EXPECT_LT(summary.before.points.fitting, points.fitting);
  EXPECT_GT(summary.before.points.rms, points.rms);
  EXPECT_EQ(adjust_bundle(plain.problem, {}).before.points.all, 0U);  // nobody had to look
}

TEST(AdjustBundle, TheCostFallsWithEveryIteration) {
  Scenario s = noisy();
  s.keyframes = 6;
  s.points = 200;
  s.lines = 30;
  const World world = make_world(s);
  BundleOptions options;
  options.rounds = 1;
  double last = 0.0;
  for (int iterations = 1; iterations <= 8; ++iterations) {  // each repeats the one before and goes on
    options.max_iterations = iterations;
    BundleProblem problem = world.problem;
    const BundleSummary summary = adjust_bundle(problem, options);
    ASSERT_TRUE(summary.usable) << summary.message;
    if (iterations == 1) last = summary.initial_cost;
    EXPECT_LE(summary.final_cost, last) << iterations;
    last = summary.final_cost;
  }
  options.max_iterations = 1;
  BundleProblem problem = world.problem;
  EXPECT_LT(last, 0.5 * adjust_bundle(problem, options).initial_cost);
}

TEST(AdjustBundle, NeedsAFixedPoseAndElseChangesNothing) {
  Scenario s = noisy();
  s.keyframes = 4;
  s.points = 50;
  s.lines = 5;
  World world = make_world(s);
  world.problem.poses[0].fixed = false;
  const BundleProblem before = world.problem;
  const BundleSummary summary = adjust_bundle(world.problem, {});
  EXPECT_FALSE(summary.usable);
  EXPECT_NE(summary.message.find("fixed"), std::string::npos);
  for (std::size_t i = 0; i < before.points.size(); ++i) EXPECT_EQ(world.problem.points[i], before.points[i]);
  for (std::size_t i = 0; i < before.poses.size(); ++i) {
    EXPECT_EQ(world.problem.poses[i].camera_from_world.translation,
              before.poses[i].camera_from_world.translation);
  }
  BundleProblem empty;
  EXPECT_FALSE(adjust_bundle(empty, {}).usable);
}

TEST(AdjustBundle, SameBytesWhereverTheHeapPutsThings) {
  for (const auto& adjust : kSolvers) {
    for (const int keyframes : {12, 104}) {  // of few and of many poses Ceres makes different equations
      Scenario s = noisy();
      s.keyframes = keyframes;
      s.points = 300;
      s.lines = 30;
      World first = make_world(s);
      World again = first;
      const BundleSummary summary = adjust(first.problem, {});
      ASSERT_TRUE(summary.usable) << summary.message;
      const tests::ShuffledHeap elsewhere(7);
      const BundleSummary other = adjust(again.problem, {});
      EXPECT_EQ(summary.final_cost, other.final_cost);
      for (std::size_t i = 0; i < first.problem.poses.size(); ++i) {
        EXPECT_EQ(std::memcmp(&first.problem.poses[i].camera_from_world,
                              &again.problem.poses[i].camera_from_world, sizeof(Rigid3)),
                  0);
      }
      for (std::size_t i = 0; i < first.problem.points.size(); ++i)
        EXPECT_EQ(first.problem.points[i], again.problem.points[i]);
      for (std::size_t i = 0; i < first.problem.lines.size(); ++i)
        EXPECT_EQ(first.problem.lines[i].n, again.problem.lines[i].n);
    }
  }
}

TEST(AdjustBundle, TheMinimumIsTheOneThatCeresFinds) {
  for (const bool with_edges : {false, true}) {
    Scenario s = noisy();
    s.keyframes = 9;
    s.points = 150;
    s.lines = 40;
    s.seed = 5;
    World world = make_world(s);
    world.problem.poses[4].fixed = true;
    for (std::size_t i = 0; with_edges && i + 1 < world.problem.poses.size(); ++i) {
      const Rigid3 b_from_a =
          world.truth.poses[i + 1].camera_from_world * world.truth.poses[i].camera_from_world.inverse();
      geometry::Vector6d information;
      information << 1e4, 2e4, 3e4, 1e5, 0.0, 2e5;
      world.problem.edges.push_back(
          {static_cast<int>(i), static_cast<int>(i + 1), b_from_a, information.asDiagonal()});
    }
    BundleOptions options;
    options.rounds = 1;
    options.max_iterations = 200;
    options.tolerance = 1e-14;
    BundleProblem reference = world.problem;
    const tests::CeresCosts expected = tests::solve_with_ceres(reference, options);
    for (const auto& adjust : kSolvers) {
      BundleProblem problem = world.problem;
      const BundleSummary summary = adjust(problem, options);
      ASSERT_TRUE(summary.usable) << summary.message;
      EXPECT_NEAR(summary.initial_cost, expected.initial, 1e-9 * expected.initial);
      EXPECT_NEAR(summary.final_cost, expected.final, 1e-8 * expected.final);
      for (std::size_t i = 0; i < problem.poses.size(); ++i) {
        const Rigid3& ours = problem.poses[i].camera_from_world;
        EXPECT_LT(tests::distance(ours, reference.poses[i].camera_from_world), 1e-5);
        EXPECT_LT(tests::angle(ours, reference.poses[i].camera_from_world), 1e-5);
      }
    }
  }
}

TEST(AdjustBundle, ANumberThatIsNoneIsTold) {
  Scenario s;
  s.keyframes = 3;
  s.points = 30;
  s.lines = 3;
  World world = make_world(s);
  world.problem.point_observations[3].pixel.x() = std::nan("");
  const BundleProblem before = world.problem;
  for (const auto& adjust : kSolvers) {
    const BundleSummary summary = adjust(world.problem, {});
    EXPECT_FALSE(summary.usable);
    EXPECT_NE(summary.message.find("not a number"), std::string::npos) << summary.message;
    EXPECT_EQ(world.problem.points[0], before.points[0]);
  }
}

TEST(AdjustBundle, EdgesAloneOrFixedPosesAloneWillDo) {
  Scenario s = noisy();
  s.keyframes = 5;
  s.points = 40;
  s.lines = 5;
  const World world = make_world(s);
  for (const auto& adjust : kSolvers) {
    BundleProblem edges;
    edges.camera = kCamera;
    edges.poses = {{Rigid3(), true}, {Rigid3()}};
    const Rigid3 step(geometry::exp_so3({0.1, 0.2, 0.3}), {1.0, 2.0, 3.0});
    edges.edges.push_back({0, 1, step, 1e8 * geometry::Matrix6d::Identity()});
    BundleOptions options;
    options.max_iterations = 100;
    options.edge_loss = 1e9;
    const BundleSummary of_edges = adjust(edges, options);
    ASSERT_TRUE(of_edges.usable) << of_edges.message;
    EXPECT_LT(tests::distance(edges.poses[1].camera_from_world, step), 1e-5);
    BundleProblem landmarks = world.problem;
    for (std::size_t i = 0; i < landmarks.poses.size(); ++i)
      landmarks.poses[i] = {world.truth.poses[i].camera_from_world, true};
    const BundleSummary of_landmarks = adjust(landmarks, {});
    ASSERT_TRUE(of_landmarks.usable) << of_landmarks.message;
    EXPECT_LT(of_landmarks.final_cost, 0.5 * of_landmarks.initial_cost);
    EXPECT_TRUE(finite(landmarks));
  }
}

TEST(AdjustBundle, ManyKeyframes) {
  Scenario s = noisy();
  s.keyframes = 64;
  s.points = 150;
  s.lines = 10;
  s.wrong_every = 0;
  const World world = make_world(s);
  for (const auto& adjust : kSolvers) {
    BundleProblem problem = world.problem;
    const BundleSummary summary = adjust(problem, {});
    ASSERT_TRUE(summary.usable) << summary.message;
    EXPECT_LT(error_of(problem, world.truth).metres, 0.02);
  }
}

}  // namespace
}  // namespace plumbline::optimize
