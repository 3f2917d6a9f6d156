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
