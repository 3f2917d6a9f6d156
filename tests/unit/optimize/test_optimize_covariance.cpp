// SPDX-License-Identifier: BSD-3-Clause
// Covariances of poses: of chains, where they can be written down, and of bundles, by how solutions scatter.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "bundle_world.hpp"
#include "plumbline/geometry/adjoint.hpp"
#include "plumbline/optimize/pose_covariances.hpp"

namespace plumbline::optimize {
namespace {

using geometry::Matrix6d;
using geometry::Vector6d;

TEST(PoseCovariances, OfAChainGrowAlongIt) {
  Random random(3);
  BundleProblem problem;
  problem.camera = kCamera;
  problem.poses = {{random.step(1.0, 0.5), true}, {random.step(1.0, 0.5)}, {random.step(1.0, 0.5)}};
  const Rigid3 step = problem.poses[2].camera_from_world * problem.poses[1].camera_from_world.inverse();
  Matrix6d roots = Matrix6d::NullaryExpr([&] { return random.normal(1.0); });
  const Matrix6d first = roots * roots.transpose() + 10.0 * Matrix6d::Identity();
  const Matrix6d second = 3.0 * first + 5.0 * Matrix6d::Identity();
  problem.edges = {
      {0, 1, problem.poses[1].camera_from_world * problem.poses[0].camera_from_world.inverse(), first},
      {1, 2, step, second}};
  const std::vector<Matrix6d> found = pose_covariances(problem, {}).of_pose;
  ASSERT_EQ(found.size(), 3U);
  EXPECT_TRUE(found[0].isZero());
  EXPECT_TRUE(found[1].isApprox(first.inverse(), 1e-9));
  const Matrix6d carried = geometry::adjoint(step) * first.inverse() * geometry::adjoint(step).transpose();
  EXPECT_TRUE(found[2].isApprox(carried + second.inverse(), 1e-9));
}

/// An edge between two poses at their present positions.
BundleEdge edge_of(const BundleProblem& problem, int a, int b, const Matrix6d& information) {
  const auto pose = [&](int i) { return problem.poses[static_cast<std::size_t>(i)].camera_from_world; };
  return {a, b, pose(b) * pose(a).inverse(), information};
}

TEST(PoseCovariances, AreNotKnownOfAPoseThatIsFreeAndRightOfTheOthers) {
  Random random(4);
  BundleProblem problem;
  problem.camera = kCamera;
  problem.poses = {{random.step(1.0, 0.5), true}, {random.step(1.0, 0.5)}, {random.step(1.0, 0.5)}};
  const Matrix6d held = geometry::information_of(0.01, 0.02);
  problem.edges = {edge_of(problem, 0, 1, held)};
  for (const bool along_one_axis : {false, true}) {
    if (along_one_axis) {
      Matrix6d along = Matrix6d::Zero();
      along(0, 0) = 1e4;
      problem.edges.push_back(edge_of(problem, 0, 2, along));
    }
    const PoseCovariances found = pose_covariances(problem, {});
    ASSERT_EQ(found.of_pose.size(), 3U) << found.missing;
    EXPECT_TRUE(found.of_pose[0].isZero());
    EXPECT_TRUE(found.of_pose[1].isApprox(held.inverse(), 1e-4));
    EXPECT_TRUE(found.of_pose[2].array().isNaN().all());
  }

  // Its rotation is known where nothing but its position is free.
  Matrix6d turn = Matrix6d::Zero();
  turn.bottomRightCorner<3, 3>() = 1e4 * Eigen::Matrix3d::Identity();
  problem.edges.back() = edge_of(problem, 0, 2, turn);
  const PoseCovariances turned = pose_covariances(problem, {});
  ASSERT_EQ(turned.of_pose.size(), 3U) << turned.missing;
  EXPECT_TRUE(turned.of_pose[2].topRows<3>().array().isNaN().all());
  EXPECT_TRUE(
      (turned.of_pose[2].bottomRightCorner<3, 3>().isApprox(1e-4 * Eigen::Matrix3d::Identity(), 1e-3)));
}

TEST(PoseCovariances, OfAPartThatNothingTiesToTheRestAreNotKnown) {
  Scenario s;
  s.keyframes = 6;
  s.points = 40;
  s.lines = 0;
  const BundleProblem one = make_world(s).truth;
  BundleProblem two = one;
  for (BundlePose pose : one.poses) {
    pose.fixed = false;
    two.poses.push_back(pose);
  }
  two.points.insert(two.points.end(), one.points.begin(), one.points.end());
  for (BundlePointObservation o : one.point_observations) {
    o.pose += static_cast<int>(one.poses.size());
    o.point += static_cast<int>(one.points.size());
    two.point_observations.push_back(o);
  }
  const std::vector<Matrix6d> expected = pose_covariances(one, {}).of_pose;
  const PoseCovariances found = pose_covariances(two, {});
  ASSERT_EQ(expected.size(), 6U);
  ASSERT_EQ(found.of_pose.size(), 12U) << found.missing;
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_TRUE(found.of_pose[i].isApprox(expected[i], 1e-3)) << i;
    EXPECT_TRUE(found.of_pose[6 + i].array().isNaN().all()) << i;
  }
}

/// A point that two views see under no measurable parallax tells their turn, and nothing else.
TEST(PoseCovariances, AreKnownWithPointsAtInfinity) {
  Scenario s;
  s.keyframes = 8;
  s.points = 60;
  s.lines = 0;
  const BundleProblem near = make_world(s).truth;
  const std::vector<Matrix6d> expected = pose_covariances(near, {}).of_pose;
  ASSERT_EQ(expected.size(), 8U);
  for (const double distance_m : {1e5, 1e7, 1e9, 1e12}) {
    BundleProblem far = near;
    Random random(5);
    for (int i = 0; i < 30; ++i) {
      const int first = i % 7;
      const Eigen::Vector3d ray(random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2), 1.0);
      far.points.push_back(far.poses[static_cast<std::size_t>(first)].camera_from_world.inverse() *
                           (distance_m * ray));
      for (const int pose : {first, first + 1}) {
        BundlePointObservation o;
        o.pose = pose;
        o.point = static_cast<int>(far.points.size()) - 1;
        o.pixel =
            kCamera.project(far.poses[static_cast<std::size_t>(pose)].camera_from_world * far.points.back());
        far.point_observations.push_back(o);
      }
    }
    const PoseCovariances found = pose_covariances(far, {});
    ASSERT_EQ(found.of_pose.size(), 8U) << distance_m << ": " << found.missing;
    for (std::size_t i = 1; i < 8; ++i) {
      const double before = expected[i].topLeftCorner<3, 3>().trace();
      const double after = found.of_pose[i].topLeftCorner<3, 3>().trace();
      EXPECT_LE(after, 1.001 * before) << distance_m << " m, pose " << i;
      EXPECT_GE(after, 0.02 * before) << distance_m << " m, pose " << i;
    }
  }
}

/// More poses than are solved densely, with a loop: those of the same chain in a dense matrix.
TEST(PoseCovariances, OfManyPosesAreThoseOfFew) {
  constexpr int kPoses = 650;
  Random random(6);
  BundleProblem problem;
  problem.camera = kCamera;
  problem.poses.push_back({Rigid3(), true});
  const Matrix6d information = geometry::information_of(0.01, 0.01);
  for (int i = 1; i < kPoses; ++i) {
    problem.poses.push_back({random.step(0.2, 0.1) * problem.poses.back().camera_from_world});
    problem.edges.push_back(edge_of(problem, i - 1, i, information));
  }
  problem.edges.push_back(edge_of(problem, 0, kPoses - 1, information));
  const std::vector<Matrix6d> found = pose_covariances(problem, {}).of_pose;
  ASSERT_EQ(found.size(), static_cast<std::size_t>(kPoses));

  // Two ways lead to each pose, and what they say is independent: information adds up.
  std::vector<Matrix6d> there(kPoses, Matrix6d::Zero());
  std::vector<Matrix6d> back(kPoses, Matrix6d::Zero());
  const auto carried = [&](const Matrix6d& covariance, int from, int to) {
    const auto pose = [&](int i) { return problem.poses[static_cast<std::size_t>(i)].camera_from_world; };
    const Matrix6d adjoint = geometry::adjoint(pose(to) * pose(from).inverse());
    return Matrix6d(adjoint * covariance * adjoint.transpose());
  };
  for (int i = 1; i < kPoses; ++i)
    there[static_cast<std::size_t>(i)] =
        carried(there[static_cast<std::size_t>(i - 1)], i - 1, i) + information.inverse();
  back.back() = information.inverse();
  for (int i = kPoses - 2; i > 0; --i) {
    back[static_cast<std::size_t>(i)] =
        carried(back[static_cast<std::size_t>(i + 1)] + information.inverse(), i + 1, i);
  }
  for (const std::size_t i : {1U, 100U, 325U, 649U}) {
    const Matrix6d expected = (there[i].inverse() + back[i].inverse()).inverse();
    EXPECT_TRUE(found[i].isApprox(expected, 1e-3)) << i;
  }
}

/// All residuals of points, one after the other.
Eigen::VectorXd residuals_of(const BundleProblem& problem, const std::vector<Rigid3>& poses,
                             const std::vector<Eigen::Vector3d>& points) {
  Eigen::VectorXd all =
      Eigen::VectorXd::Zero(static_cast<Eigen::Index>(3 * problem.point_observations.size()));
  for (std::size_t i = 0; i < problem.point_observations.size(); ++i) {
    const BundlePointObservation& o = problem.point_observations[i];
    const Eigen::Vector3d p =
        poses[static_cast<std::size_t>(o.pose)] * points[static_cast<std::size_t>(o.point)];
    const Eigen::Vector2d off = (problem.camera.project(p) - o.pixel) / o.pixel_sigma;
    all.segment<3>(static_cast<Eigen::Index>(3 * i)) << off, (p.z() - o.depth) / o.depth_sigma;
  }
  return all;
}

/// Differences instead of derivatives, and no elimination.
TEST(PoseCovariances, AreThoseOfTheWholeNormalMatrix) {
  Scenario s;
  s.keyframes = 4;
  s.points = 15;
  s.lines = 0;
  const BundleProblem problem = make_world(s).truth;
  const auto poses = static_cast<Eigen::Index>(problem.poses.size());
  const auto points = static_cast<Eigen::Index>(problem.points.size());
  constexpr double kStep = 1e-6;
  Eigen::MatrixXd jacobian(3 * static_cast<Eigen::Index>(problem.point_observations.size()),
                           6 * poses + 3 * points);
  for (Eigen::Index c = 0; c < jacobian.cols(); ++c) {
    const auto moved = [&](double step) {
      std::vector<Rigid3> at;
      for (const BundlePose& pose : problem.poses) at.push_back(pose.camera_from_world);
      std::vector<Eigen::Vector3d> where = problem.points;
      if (c < 6 * poses) {
        Rigid3& pose = at[static_cast<std::size_t>(c / 6)];
        pose = geometry::exp_se3(step * Vector6d::Unit(c % 6)) * pose;
      } else {
        where[static_cast<std::size_t>((c - 6 * poses) / 3)][(c - 6 * poses) % 3] += step;
      }
      return residuals_of(problem, at, where);
    };
    jacobian.col(c) = (moved(kStep) - moved(-kStep)) / (2.0 * kStep);
  }
  ASSERT_TRUE(problem.poses[0].fixed);
  const Eigen::MatrixXd free = jacobian.rightCols(jacobian.cols() - 6);
  Eigen::MatrixXd normal = free.transpose() * free;
  for (Eigen::Index c = 0; c < normal.cols(); ++c) {
    if (normal(c, c) == 0.0) normal(c, c) = 1.0;  // a point that nobody sees
  }
  const Eigen::MatrixXd inverse = normal.inverse();
  const std::vector<Matrix6d> found = pose_covariances(problem, {}).of_pose;
  ASSERT_EQ(found.size(), 4U);
  for (Eigen::Index i = 1; i < poses; ++i) {
    const Matrix6d expected = inverse.block<6, 6>(6 * (i - 1), 6 * (i - 1));
    EXPECT_TRUE(found[static_cast<std::size_t>(i)].isApprox(expected, 1e-4)) << i;
  }
}

/// Solutions from many draws of the noise: their squared errors over the covariance are 6 on average.
TEST(PoseCovariances, TellHowSolutionsScatter) {
  Scenario s;
  s.keyframes = 4;
  s.points = 60;
  s.lines = 10;
  s.pixel_noise = 0.7;
  s.depth_noise = 0.01;
  BundleOptions options;
  options.rounds = 1;
  options.point_loss = options.line_loss = 1e3;  // plain least squares
  constexpr int kDraws = 400;
  std::vector<double> sums(4, 0.0);
  for (int draw = 0; draw < kDraws; ++draw) {
    s.seed = static_cast<std::uint32_t>(draw + 1);
    World world = make_world(s);
    for (BundleLineObservation& o : world.problem.line_observations) o.has_depth = false;
    ASSERT_TRUE(adjust_bundle(world.problem, options).usable);
    const std::vector<Matrix6d> covariances = pose_covariances(world.problem, options).of_pose;
    ASSERT_EQ(covariances.size(), 4U);
    for (std::size_t i = 1; i < 4; ++i) {
      const Vector6d error = geometry::log_se3(world.problem.poses[i].camera_from_world *
                                               world.truth.poses[i].camera_from_world.inverse());
      sums[i] += error.dot(covariances[i].llt().solve(error));
    }
  }
  for (std::size_t i = 1; i < 4; ++i)
    EXPECT_NEAR(sums[i] / kDraws, 6.0, 0.6) << i;  // 3.5 standard deviations
}

}  // namespace
}  // namespace plumbline::optimize
