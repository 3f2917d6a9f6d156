// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "ceres_bundle.hpp"
#include "plumbline/optimize/bundle_adjustment.hpp"
#include "random_world.hpp"

namespace plumbline::optimize {
namespace {

using geometry::Rigid3;
using tests::Random;

const sensor::Pinhole kCamera{640, 480, 525.0, 525.0, 319.5, 239.5};

struct Scenario {
  int keyframes = 20;
  int points = 2000;
  int lines = 200;
  double pixel_noise = 0.0;
  double depth_noise = 0.0;
  int wrong_every = 0;        ///< every n-th observation is wrong; 0: none
  double pose_error_m = 0.0;  ///< of the start
  double pose_error_rad = 0.0;
  double landmark_error_m = 0.0;
  std::uint32_t seed = 1;
};

struct World {
  BundleProblem problem;
  BundleProblem truth;
};

bool visible(const Eigen::Vector3d& p) { return p.z() > 0.4 && kCamera.contains(kCamera.project(p)); }

void see_point(const Scenario& s, Random& random, BundleProblem& problem, int pose, int point) {
  const Eigen::Vector3d p = problem.poses[static_cast<std::size_t>(pose)].camera_from_world *
                            problem.points[static_cast<std::size_t>(point)];
  if (!visible(p)) return;
  BundlePointObservation o;
  o.pose = pose;
  o.point = point;
  o.pixel = kCamera.project(p) + s.pixel_noise * Eigen::Vector2d(random.normal(), random.normal());
  o.pixel_sigma = std::max(0.5, s.pixel_noise);
  o.depth = p.z() + random.normal(s.depth_noise);
  o.depth_sigma = std::max(0.01, s.depth_noise);
  const std::size_t count = problem.point_observations.size();
  if (s.wrong_every > 0 && count % static_cast<std::size_t>(s.wrong_every) == 0) {
    o.pixel += Eigen::Vector2d(random.uniform(20, 60), random.uniform(-60, -20));
  }
  problem.point_observations.push_back(o);
}

void see_line(const Scenario& s, Random& random, BundleProblem& problem, int pose, int line,
              const std::pair<Eigen::Vector3d, Eigen::Vector3d>& ends) {
  const Rigid3& camera_from_world = problem.poses[static_cast<std::size_t>(pose)].camera_from_world;
  const Eigen::Vector3d a = camera_from_world * ends.first;
  const Eigen::Vector3d b = camera_from_world * ends.second;
  if (!visible(a) || !visible(b)) return;
  BundleLineObservation o;
  o.pose = pose;
  o.line = line;
  o.start = kCamera.project(a) + s.pixel_noise * Eigen::Vector2d(random.normal(), random.normal());
  o.end = kCamera.project(b) + s.pixel_noise * Eigen::Vector2d(random.normal(), random.normal());
  o.pixel_sigma = std::max(0.5, s.pixel_noise);
  o.has_depth = true;
  o.start_camera = kCamera.unproject(o.start.x(), o.start.y(), a.z() + random.normal(s.depth_noise));
  o.end_camera = kCamera.unproject(o.end.x(), o.end.y(), b.z() + random.normal(s.depth_noise));
  o.start_sigma = o.end_sigma = std::max(0.01, s.depth_noise);
  if (s.wrong_every > 0 && problem.line_observations.size() % static_cast<std::size_t>(s.wrong_every) == 0) {
    o.start += Eigen::Vector2d(30.0, 40.0);
    o.has_depth = false;
  }
  problem.line_observations.push_back(o);
}

/// Cameras on an arc that look at a cloud of points and segments; the first pose is held.
World make_world(const Scenario& s) {
  Random random(s.seed);
  World world;
  BundleProblem& truth = world.truth;
  truth.camera = kCamera;
  for (int i = 0; i < s.keyframes; ++i) {
    const double phi = 0.05 * (i - 0.5 * s.keyframes);
    const Rigid3 world_from_camera(geometry::exp_so3({0.05 * std::sin(0.9 * i), phi, 0.02 * i}),
                                   {-2.5 * phi, 0.2 * std::sin(0.5 * i), 0.1 * std::cos(0.7 * i)});
    truth.poses.push_back({world_from_camera.inverse(), i == 0});
  }
  for (int i = 0; i < s.points; ++i) {
    truth.points.emplace_back(random.uniform(-2, 2), random.uniform(-1.4, 1.4), random.uniform(1.8, 4.0));
  }
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> ends;
  for (int i = 0; i < s.lines; ++i) {
    const Eigen::Vector3d a(random.uniform(-1.5, 1.5), random.uniform(-1, 1), random.uniform(1.8, 4.0));
    const Eigen::Vector3d b = a + random.uniform(0.4, 1.0) * random.direction();
    ends.emplace_back(a, b);
    truth.lines.push_back(geometry::line_through(a, b));
  }
  for (int k = 0; k < s.keyframes; ++k) {
    for (int i = 0; i < s.points; ++i) see_point(s, random, truth, k, i);
    for (int i = 0; i < s.lines; ++i) see_line(s, random, truth, k, i, ends[static_cast<std::size_t>(i)]);
  }
  world.problem = truth;
  for (BundlePose& pose : world.problem.poses) {
    if (!pose.fixed) {
      pose.camera_from_world = random.step(s.pose_error_m, s.pose_error_rad) * pose.camera_from_world;
    }
  }
  for (Eigen::Vector3d& p : world.problem.points) p += random.vector(s.landmark_error_m);
  for (std::size_t i = 0; i < ends.size(); ++i) {
    world.problem.lines[i] = geometry::line_through(ends[i].first + random.vector(s.landmark_error_m),
                                                    ends[i].second + random.vector(s.landmark_error_m));
  }
  return world;
}

struct Error {
  double metres = 0.0;  ///< RMS over the poses
  double degrees = 0.0;
};
Error error_of(const BundleProblem& found, const BundleProblem& truth) {
  Error e;
  for (std::size_t i = 0; i < found.poses.size(); ++i) {
    const double d = tests::distance(found.poses[i].camera_from_world, truth.poses[i].camera_from_world);
    const double a =
        tests::angle(found.poses[i].camera_from_world, truth.poses[i].camera_from_world) * 57.29578;
    e.metres += d * d;
    e.degrees += a * a;
  }
  const auto n = static_cast<double>(found.poses.size());
  return {std::sqrt(e.metres / n), std::sqrt(e.degrees / n)};
}

bool finite(const BundleProblem& problem) {
  for (const BundlePose& pose : problem.poses) {
    if (!pose.camera_from_world.translation.allFinite() || !pose.camera_from_world.rotation.allFinite())
      return false;
  }
  for (const auto& p : problem.points) {
    if (!p.allFinite()) return false;
  }
  for (const auto& l : problem.lines) {
    if (!l.n.allFinite() || !l.v.allFinite()) return false;
  }
  return true;
}

Scenario noisy() {
  Scenario s;
  s.pixel_noise = 0.7;
  s.depth_noise = 0.01;
  s.wrong_every = 10;
  s.pose_error_m = 0.05;
  s.pose_error_rad = 0.03;
  s.landmark_error_m = 0.03;
  return s;
}

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

TEST(AdjustBundle, EdgesAloneHoldPosesAndFreeDirectionsStay) {
  Scenario s;
  s.keyframes = 5;
  s.points = 0;
  s.lines = 0;
  s.pose_error_m = 0.05;
  s.pose_error_rad = 0.03;
  World world = make_world(s);
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

TEST(AdjustBundle, SameBytesForAnyNumberOfThreads) {
  Scenario s = noisy();
  s.keyframes = 70;
  s.points = 700;
  s.lines = 60;
  World first = make_world(s);
  const BundleSummary summary = adjust_bundle(first.problem, {});
  ASSERT_TRUE(summary.usable);
  for (const int threads : {1, 2, 3}) {
    const core::Executor executor(threads);
    World again = make_world(s);
    const BundleSummary other = adjust_bundle(again.problem, {}, &executor);
    EXPECT_EQ(std::memcmp(&summary.final_cost, &other.final_cost, sizeof(double)), 0);
    for (std::size_t i = 0; i < first.problem.poses.size(); ++i) {
      const Rigid3& x = first.problem.poses[i].camera_from_world;
      const Rigid3& y = again.problem.poses[i].camera_from_world;
      EXPECT_EQ(std::memcmp(x.rotation.data(), y.rotation.data(), 9 * sizeof(double)), 0);
      EXPECT_EQ(std::memcmp(x.translation.data(), y.translation.data(), 3 * sizeof(double)), 0);
    }
    for (std::size_t i = 0; i < first.problem.points.size(); ++i)
      EXPECT_EQ(first.problem.points[i], again.problem.points[i]);
    for (std::size_t i = 0; i < first.problem.lines.size(); ++i)
      EXPECT_EQ(first.problem.lines[i].n, again.problem.lines[i].n);
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
    options.tolerance = 0.0;
    BundleProblem ceres_problem = world.problem;
    const tests::CeresCosts expected = tests::solve_with_ceres(ceres_problem, options);
    const BundleSummary summary = adjust_bundle(world.problem, options);
    ASSERT_TRUE(summary.usable);
    EXPECT_NEAR(summary.initial_cost, expected.initial, 1e-9 * expected.initial);
    EXPECT_NEAR(summary.final_cost, expected.final, 1e-8 * expected.final);
    for (std::size_t i = 0; i < world.problem.poses.size(); ++i) {
      const Rigid3& ours = world.problem.poses[i].camera_from_world;
      EXPECT_LT(tests::distance(ours, ceres_problem.poses[i].camera_from_world), 1e-5);
      EXPECT_LT(tests::angle(ours, ceres_problem.poses[i].camera_from_world), 1e-5);
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
  const BundleSummary summary = adjust_bundle(world.problem, {});
  EXPECT_FALSE(summary.usable);
  EXPECT_NE(summary.message.find("not a number"), std::string::npos) << summary.message;
  EXPECT_EQ(world.problem.points[0], before.points[0]);
}

TEST(AdjustBundle, ManyKeyframes) {
  Scenario s = noisy();
  s.keyframes = 64;
  s.points = 150;
  s.lines = 10;
  s.wrong_every = 0;
  World world = make_world(s);
  const BundleSummary summary = adjust_bundle(world.problem, {});
  ASSERT_TRUE(summary.usable) << summary.message;
  EXPECT_LT(error_of(world.problem, world.truth).metres, 0.02);
}

}  // namespace
}  // namespace plumbline::optimize
