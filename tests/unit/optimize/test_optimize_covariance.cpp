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
  const std::vector<Matrix6d> found = pose_covariances(problem, {});
  ASSERT_EQ(found.size(), 3U);
  EXPECT_TRUE(found[0].isZero());
  EXPECT_TRUE(found[1].isApprox(first.inverse(), 1e-9));
  const Matrix6d carried = geometry::adjoint(step) * first.inverse() * geometry::adjoint(step).transpose();
  EXPECT_TRUE(found[2].isApprox(carried + second.inverse(), 1e-9));
}

TEST(PoseCovariances, AreEmptyWhereSomethingIsFree) {
  BundleProblem problem;
  problem.camera = kCamera;
  problem.poses = {{Rigid3(), true}, {Rigid3()}};
  EXPECT_TRUE(pose_covariances(problem, {}).empty());
  Matrix6d along = Matrix6d::Zero();
  along(0, 0) = 1e4;
  problem.edges.push_back({0, 1, Rigid3(), along});
  EXPECT_TRUE(pose_covariances(problem, {}).empty());
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
  const std::vector<Matrix6d> found = pose_covariances(problem, {});
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
    const std::vector<Matrix6d> covariances = pose_covariances(world.problem, options);
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
