// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <limits>

#include "plumbline/optimize/pose_solver.hpp"
#include "random_world.hpp"

namespace plumbline::optimize {
namespace {

using geometry::Rigid3;
using geometry::Vector6d;
using tests::Random;

const sensor::Pinhole kCamera{640, 480, 525.0, 525.0, 319.5, 239.5};

struct PoseWorld {
  PoseProblem problem;
  Rigid3 truth;
};

Eigen::Vector3d in_view(Random& random) {
  return kCamera.unproject(random.uniform(10, 630), random.uniform(10, 470), random.uniform(1.0, 4.0));
}

/// Exact measurements at `truth`; every `outlier`-th term is wrong (0: none).
PoseWorld make_world(int points, int lines, int planes, std::uint32_t seed, int outlier = 0) {
  Random random(seed);
  PoseWorld world;
  world.truth = random.pose(3.0, 3.0);
  world.problem.camera = kCamera;
  const Rigid3 world_from_camera = world.truth.inverse();
  const auto wrong = [&](int i) { return outlier > 0 && i % outlier == 0; };
  for (int i = 0; i < points; ++i) {
    const Eigen::Vector3d p = in_view(random);
    PointTerm term;
    term.world = world_from_camera * p;
    term.pixel = kCamera.project(p);
    if (i % 2 == 0) {
      term.depth = p.z();
      term.depth_sigma = 0.01;
    }
    if (wrong(i)) term.pixel += Eigen::Vector2d(random.uniform(15, 60), random.uniform(-60, -15));
    world.problem.points.push_back(term);
  }
  for (int i = 0; i < lines; ++i) {
    const Eigen::Vector3d a = in_view(random);
    const Eigen::Vector3d b = in_view(random);
    LineTerm term;
    term.world = geometry::line_through(world_from_camera * a, world_from_camera * b);
    term.start = kCamera.project(a);
    term.end = kCamera.project(b);
    if (wrong(i)) term.start += Eigen::Vector2d(40.0, 50.0);
    world.problem.lines.push_back(term);
  }
  for (int i = 0; i < planes; ++i) {
    const Eigen::Vector3d p = in_view(random);
    PlaneTerm term;
    term.camera = p;
    term.normal = Eigen::Vector3d::Unit(i % 3);  // a corner of a room
    term.normal = world_from_camera.rotation * geometry::exp_so3({0.5, 0.4, 0.3}) * term.normal;
    term.world = world_from_camera * p + 0.2 * term.normal.unitOrthogonal();
    if (wrong(i)) term.camera.z() += 0.3;
    world.problem.planes.push_back(term);
  }
  return world;
}

void expect_found(const PoseWorld& world, double metres, double radians, double tolerance, const char* what) {
  Random random(99);
  PoseSolverOptions options;
  options.max_iterations = 50;
  for (int i = 0; i < 10; ++i) {
    const Rigid3 start = random.step(metres, radians) * world.truth;
    const PoseSummary summary = solve_pose(world.problem, start, options);
    EXPECT_LE(summary.final_cost, summary.initial_cost) << what;
    EXPECT_LT(tests::distance(summary.camera_from_world, world.truth), tolerance) << what;
    EXPECT_LT(tests::angle(summary.camera_from_world, world.truth), tolerance) << what;
    EXPECT_TRUE(summary.information.isApprox(summary.information.transpose())) << what;
  }
}

TEST(SolvePose, ReturnsToTheTruthFromEachFamilyAlone) {
  expect_found(make_world(80, 0, 0, 1), 0.2, 0.15, 1e-5, "points");
  expect_found(make_world(0, 40, 0, 2), 0.1, 0.1, 1e-5, "lines");
  expect_found(make_world(0, 0, 300, 3), 0.1, 0.1, 1e-5, "planes");
  expect_found(make_world(80, 40, 300, 4), 0.2, 0.15, 1e-5, "all");
}

TEST(SolvePose, FewestTermsThatHoldAPose) {
  expect_found(make_world(5, 0, 0, 5), 0.05, 0.05, 1e-5, "five points");
  expect_found(make_world(2, 4, 0, 6), 0.05, 0.05, 1e-5, "two points, four lines");
}

TEST(SolvePose, ThirtyPercentOutliersMoveItLittle) {
  // Huber does not reject: what stays is a bounded pull that the gates of the tracker then remove.
  expect_found(make_world(200, 0, 0, 7, 3), 0.1, 0.1, 0.02, "points");
  const PoseWorld world = make_world(200, 60, 300, 8, 3);
  expect_found(world, 0.1, 0.1, 0.02, "all");
  PoseSolverOptions options;
  options.max_iterations = 50;
  const PoseSummary summary = solve_pose(world.problem, world.truth, options);
  EXPECT_NEAR(summary.points.inliers, 133, 3);
  EXPECT_EQ(summary.points.terms, 200);
  // Least squares without a robust loss is thrown off: the loss is what helps.
  options.point_loss = options.line_loss = options.plane_loss = 100.0;
  const PoseSummary plain = solve_pose(world.problem, world.truth, options);
  EXPECT_GT(tests::distance(plain.camera_from_world, world.truth),
            3.0 * tests::distance(summary.camera_from_world, world.truth));
}

TEST(SolvePose, NeverIncreasesTheCost) {
  for (std::uint32_t seed = 0; seed < 40; ++seed) {
    PoseWorld world = make_world(30, 10, 30, 100 + seed, seed % 2 == 0 ? 2 : 0);
    Random random(seed);
    const Rigid3 start = random.pose(3.0, 3.0);  // anywhere: nothing fits
    const PoseSummary summary = solve_pose(world.problem, start, {});
    EXPECT_LE(summary.final_cost, summary.initial_cost);
    EXPECT_TRUE(summary.camera_from_world.translation.allFinite());
    // The cost told is the cost of the pose told.
    EXPECT_NEAR(solve_pose(world.problem, summary.camera_from_world, {}).initial_cost, summary.final_cost,
                1e-9 * (1.0 + summary.final_cost));
  }
}

TEST(SolvePose, WithoutTermsStaysAtTheStart) {
  Random random(10);
  const Rigid3 start = random.pose(2.0, 2.0);
  PoseProblem empty;
  empty.camera = kCamera;
  const PoseSummary summary = solve_pose(empty, start, {});
  EXPECT_LT(tests::distance(summary.camera_from_world, start), 1e-12);
  EXPECT_LT(tests::angle(summary.camera_from_world, start), 1e-7);
  EXPECT_EQ(summary.final_cost, 0.0);
  EXPECT_EQ(summary.points.terms + summary.lines.terms + summary.planes.terms, 0);
  EXPECT_TRUE(summary.information.isZero());
}

TEST(SolvePose, PointsBehindTheCameraAreLeftOutAndCounted) {
  PoseWorld world = make_world(60, 0, 0, 11);
  const Rigid3 world_from_camera = world.truth.inverse();
  for (int i = 0; i < 20; ++i) {
    PointTerm term = world.problem.points[static_cast<std::size_t>(i)];
    term.world = world_from_camera * Eigen::Vector3d(0.1 * i, 0.2, -2.0);
    world.problem.points.push_back(term);
  }
  expect_found(world, 0.05, 0.05, 1e-5, "points behind");
  const auto errors = point_errors(world.problem, world.truth);
  ASSERT_EQ(errors.size(), 80U);
  EXPECT_LT(errors[0], 1e-9);
  EXPECT_EQ(errors[70], std::numeric_limits<double>::infinity());
}

TEST(SolvePose, HidingThePointsBehindTheCameraIsNoSolution) {
  // From a start so bad that a large step throws points behind the camera: what cannot be seen costs, too.
  for (std::uint32_t seed = 0; seed < 30; ++seed) {
    const PoseWorld world = make_world(40, 0, 0, 200 + seed);
    Random random(seed);
    const Rigid3 start = random.step(1.5, 0.8) * world.truth;
    const auto in_front = [&](const Rigid3& pose) {
      int count = 0;
      for (double e : point_errors(world.problem, pose)) count += std::isfinite(e) ? 1 : 0;
      return count;
    };
    PoseSolverOptions options;
    options.max_iterations = 50;
    const PoseSummary summary = solve_pose(world.problem, start, options);
    EXPECT_GE(in_front(summary.camera_from_world), in_front(start)) << "seed " << seed;
  }
}

TEST(SolvePose, ALineThroughTheCameraCentreIsLeftOut) {
  PoseWorld world = make_world(40, 20, 0, 12);
  LineTerm through;
  through.world = geometry::line_through(world.truth.inverse().translation, Eigen::Vector3d(9, 9, 9));
  through.start = {10, 10};
  through.end = {600, 400};
  world.problem.lines.push_back(through);
  const PoseSummary summary = solve_pose(world.problem, world.truth, {});
  EXPECT_LT(tests::distance(summary.camera_from_world, world.truth), 1e-6);
  EXPECT_EQ(line_errors(world.problem, world.truth).back(), std::numeric_limits<double>::infinity());
  EXPECT_EQ(summary.lines.inliers, 20);
}

TEST(SolvePose, ParallelPlanesLeaveTheWeakDirectionsAtTheStart) {
  Random random(13);
  PoseWorld world;
  world.truth = Rigid3();
  world.problem.camera = kCamera;
  for (int i = 0; i < 300; ++i) {  // a wall straight ahead, at 2 m
    PlaneTerm term;
    term.camera = kCamera.unproject(random.uniform(0, 640), random.uniform(0, 480), 2.0);
    term.world = {random.uniform(-1, 1), random.uniform(-1, 1), 2.0};
    term.normal = {0.0, 0.0, -1.0};
    world.problem.planes.push_back(term);
  }
  Vector6d xi;
  xi << 0.03, -0.02, 0.05, 0.02, -0.03, 0.04;
  const Rigid3 start = geometry::exp_se3(xi);
  PoseSolverOptions options;
  options.max_iterations = 50;
  const PoseSummary summary = solve_pose(world.problem, start, options);
  const Eigen::Vector3d centre = summary.camera_from_world.inverse().translation;
  const Eigen::Vector3d before = start.inverse().translation;
  EXPECT_NEAR(centre.z(), 0.0, 1e-5) << "the wall holds the distance";
  EXPECT_NEAR(summary.camera_from_world.rotation.row(2).dot(Eigen::RowVector3d::UnitZ()), 1.0, 1e-8)
      << "and the tilt";
  EXPECT_NEAR(centre.x(), before.x(), 0.005) << "it says nothing about sliding along it";
  EXPECT_NEAR(centre.y(), before.y(), 0.005);
  const double roll =
      std::atan2(summary.camera_from_world.rotation(1, 0), summary.camera_from_world.rotation(0, 0));
  EXPECT_NEAR(roll, 0.04, 0.005) << "nor about turning on its normal";
  const Eigen::SelfAdjointEigenSolver<geometry::Matrix6d> eigen(summary.information);
  EXPECT_LT(eigen.eigenvalues()(2), 1e-3 * eigen.eigenvalues()(3)) << "three weak directions, three held";
}

TEST(SolvePose, PriorHoldsWhatTermsDoNot) {
  PoseWorld world = make_world(0, 0, 0, 14);
  PosePrior prior;
  prior.camera_from_world = world.truth;
  prior.information = 1e4 * geometry::Matrix6d::Identity();
  world.problem.prior = prior;
  Random random(15);
  const PoseSummary summary = solve_pose(world.problem, random.step(0.1, 0.1) * world.truth, {});
  EXPECT_LT(tests::distance(summary.camera_from_world, world.truth), 1e-4);
  EXPECT_TRUE(summary.information.isZero()) << "the prior is not counted as measured";
}

TEST(SolvePose, InformationTellsTheSpreadOfSolutions) {
  // Monte Carlo: squared errors under pixel noise, weighted with the information, average 6.
  Random random(16);
  double sum = 0.0;
  constexpr int kRounds = 200;
  for (int i = 0; i < kRounds; ++i) {
    PoseWorld world = make_world(60, 0, 0, 17);
    for (PointTerm& term : world.problem.points) {
      term.pixel += Eigen::Vector2d(random.normal(), random.normal());
      if (term.depth > 0.0) term.depth += random.normal(term.depth_sigma);
    }
    PoseSolverOptions options;
    options.point_loss = options.plane_loss = 100.0;
    const PoseSummary summary = solve_pose(world.problem, world.truth, options);
    const Vector6d xi = geometry::log_se3(summary.camera_from_world * world.truth.inverse());
    sum += xi.dot(summary.information * xi);
  }
  EXPECT_NEAR(sum / kRounds, 6.0, 1.0);
}

TEST(SolvePose, NotANumberIsNotReturned) {
  PoseWorld world = make_world(30, 0, 0, 18);
  world.problem.points[3].pixel.x() = std::numeric_limits<double>::quiet_NaN();
  const PoseSummary summary = solve_pose(world.problem, world.truth, {});
  EXPECT_TRUE(summary.camera_from_world.translation.allFinite());
  EXPECT_TRUE(summary.camera_from_world.rotation.allFinite());
  EXPECT_EQ(summary.points.inliers, 29);
}

}  // namespace
}  // namespace plumbline::optimize
