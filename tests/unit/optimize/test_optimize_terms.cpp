// SPDX-License-Identifier: BSD-3-Clause
// Analytic Jacobians of every residual against central differences.
#include <gtest/gtest.h>

#include "bundle_terms.hpp"
#include "numeric_jacobian.hpp"
#include "plumbline/optimize/pose_terms.hpp"
#include "random_world.hpp"

namespace plumbline::optimize {
namespace {

using geometry::Rigid3;
using geometry::Vector6d;
using tests::numeric_jacobian;
using tests::Random;

const sensor::Pinhole kTermCamera{640, 480, 520.0, 540.0, 318.0, 243.0};
const Eigen::Matrix3d kProjection = geometry::line_projection(520.0, 540.0, 318.0, 243.0);

/// Largest difference, as a share of the largest entry.
template <typename A, typename B>
double relative(const A& analytic, const B& numeric) {
  return (analytic - numeric).cwiseAbs().maxCoeff() / (1.0 + numeric.cwiseAbs().maxCoeff());
}

Eigen::Vector3d in_front(Random& random) {
  return {random.uniform(-1.5, 1.5), random.uniform(-1.0, 1.0), random.uniform(0.8, 5.0)};
}

TEST(PointResidual, IsTheReprojectionAndDepthError) {
  PointTerm term;
  term.world = {0.2, -0.1, 2.0};
  term.pixel = kTermCamera.project(term.world) + Eigen::Vector2d(3.0, -1.0);
  term.pixel_sigma = 2.0;
  Eigen::Vector3d r;
  EXPECT_EQ(point_residual(term, {}, kTermCamera, r, nullptr), 2);
  EXPECT_NEAR(r(0), 1.5, 1e-12);
  EXPECT_NEAR(r(1), -0.5, 1e-12);
  EXPECT_EQ(r(2), 0.0);
  term.depth = 2.02;
  term.depth_sigma = 0.01;
  EXPECT_EQ(point_residual(term, {}, kTermCamera, r, nullptr), 3);
  EXPECT_NEAR(r(2), 2.0, 1e-9);
  term.world.z() = -2.0;
  EXPECT_EQ(point_residual(term, {}, kTermCamera, r, nullptr), 0) << "behind the camera";
  term.world.z() = 0.0;
  EXPECT_EQ(point_residual(term, {}, kTermCamera, r, nullptr), 0) << "in the camera";
}

TEST(PointResidual, Jacobian) {
  Random random(1);
  for (int i = 0; i < 30; ++i) {
    const Rigid3 pose = random.pose(3.0, 2.0);
    PointTerm term;
    term.world = pose.inverse() * in_front(random);
    term.pixel = {random.uniform(0, 640), random.uniform(0, 480)};
    term.pixel_sigma = random.uniform(0.5, 3.0);
    term.depth = i % 2 == 0 ? 2.0 : 0.0;
    term.depth_sigma = 0.02;
    Eigen::Vector3d r;
    Eigen::Matrix<double, 3, 6> j;
    ASSERT_EQ(point_residual(term, pose, kTermCamera, r, &j), i % 2 == 0 ? 3 : 2);
    const auto numeric = numeric_jacobian<3, 6>([&](const Vector6d& xi) {
      Eigen::Vector3d e;
      point_residual(term, geometry::exp_se3(xi) * pose, kTermCamera, e, nullptr);
      return e;
    });
    EXPECT_LT(relative(j, numeric), 1e-6);
  }
}

TEST(LineResidual, IsTheDistanceOfTheEndpoints) {
  LineTerm term;  // a horizontal line, in the image at v = 243 + 540 * 0.5 / 2
  term.world = geometry::line_through({-1.0, 0.5, 2.0}, {1.0, 0.5, 2.0});
  term.start = {100.0, 243.0 + 135.0 + 4.0};
  term.end = {300.0, 243.0 + 135.0 - 2.0};
  term.pixel_sigma = 2.0;
  Eigen::Vector2d r;
  ASSERT_TRUE(line_residual(term, {}, kProjection, r, nullptr));
  EXPECT_NEAR(std::abs(r(0)), 2.0, 1e-9);
  EXPECT_NEAR(std::abs(r(1)), 1.0, 1e-9);
  EXPECT_LT(r(0) * r(1), 0.0) << "on both sides of the line";
}

TEST(LineResidual, ALineThroughTheCameraHasNoImage) {
  LineTerm term;
  term.world = geometry::line_through({0, 0, 0}, {0.1, 0.2, 1.0});
  Eigen::Vector2d r;
  EXPECT_FALSE(line_residual(term, {}, kProjection, r, nullptr));
  EXPECT_TRUE(line_residual(term, {Eigen::Matrix3d::Identity(), {0.1, 0.0, 0.0}}, kProjection, r, nullptr));
}

TEST(LineResidual, Jacobian) {
  Random random(2);
  for (int i = 0; i < 30; ++i) {
    const Rigid3 pose = random.pose(3.0, 2.0);
    LineTerm term;
    term.world =
        geometry::transform(pose.inverse(), geometry::line_through(in_front(random), in_front(random)));
    term.start = {random.uniform(0, 640), random.uniform(0, 480)};
    term.end = {random.uniform(0, 640), random.uniform(0, 480)};
    term.pixel_sigma = 1.3;
    Eigen::Vector2d r;
    Eigen::Matrix<double, 2, 6> j;
    ASSERT_TRUE(line_residual(term, pose, kProjection, r, &j));
    const auto numeric = numeric_jacobian<2, 6>([&](const Vector6d& xi) {
      Eigen::Vector2d e;
      line_residual(term, geometry::exp_se3(xi) * pose, kProjection, e, nullptr);
      return e;
    });
    EXPECT_LT(relative(j, numeric), 1e-6);
  }
}

TEST(PlaneResidual, ValueAndJacobian) {
  PlaneTerm simple;
  simple.camera = {0.3, 0.1, 2.05};
  simple.world = {0.0, 0.0, 2.0};
  simple.normal = {0.0, 0.0, -1.0};
  simple.sigma = 0.01;
  EXPECT_NEAR(plane_residual(simple, {}, nullptr), -5.0, 1e-9);

  Random random(3);
  for (int i = 0; i < 30; ++i) {
    const Rigid3 pose = random.pose(3.0, 2.0);
    PlaneTerm term;
    term.camera = in_front(random);
    term.world = pose.inverse() * in_front(random);
    term.normal = random.direction();
    term.sigma = 0.02;
    Row6 j;
    plane_residual(term, pose, &j);
    const auto numeric = numeric_jacobian<1, 6>([&](const Vector6d& xi) {
      return Eigen::Matrix<double, 1, 1>(plane_residual(term, geometry::exp_se3(xi) * pose, nullptr));
    });
    EXPECT_LT(relative(j, numeric), 1e-6);
  }
}

BundleLineObservation line_observation(Random& random, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  BundleLineObservation seen;
  seen.start = kTermCamera.project(a) + Eigen::Vector2d(random.normal(2.0), random.normal(2.0));
  seen.end = kTermCamera.project(b) + Eigen::Vector2d(random.normal(2.0), random.normal(2.0));
  seen.pixel_sigma = 1.2;
  seen.has_depth = true;
  seen.start_camera = a + random.vector(0.03);
  seen.end_camera = b + random.vector(0.03);
  seen.start_sigma = 0.02;
  seen.end_sigma = 0.03;
  return seen;
}

/// Both Jacobians of a line's residuals against central differences.
void expect_line_jacobians(const BundleLineObservation& seen, const Rigid3& pose,
                           const geometry::OrthonormalLine& line) {
  const LineView view(seen, kTermCamera);
  LineDerivatives j;
  const Eigen::Vector4d r = line_rows(view, kProjection, pose, line, &j);
  EXPECT_EQ(r, line_rows(view, kProjection, pose, line, nullptr));
  const auto by_pose = numeric_jacobian<4, 6>([&](const Vector6d& xi) {
    return line_rows(view, kProjection, geometry::exp_se3(xi) * pose, line, nullptr);
  });
  EXPECT_LT(relative(j.by_pose, by_pose), 1e-5);
  const auto by_line = numeric_jacobian<4, 4>([&](const Eigen::Vector4d& delta) {
    return line_rows(view, kProjection, pose, geometry::update(line, delta), nullptr);
  });
  EXPECT_LT(relative(j.by_line, by_line), 1e-5);
}

TEST(LineRows, JacobiansWithAndWithoutDepth) {
  Random random(6);
  for (int i = 0; i < 30; ++i) {
    const Rigid3 pose = random.pose(3.0, 2.0);
    const Rigid3 world_from_camera = pose.inverse();
    const Eigen::Vector3d a = in_front(random);
    const Eigen::Vector3d b = in_front(random);
    BundleLineObservation seen = line_observation(random, a, b);
    seen.has_depth = i % 2 == 0;
    expect_line_jacobians(
        seen, pose,
        geometry::to_orthonormal(geometry::line_through(world_from_camera * a, world_from_camera * b)));
  }
}

TEST(LineRows, JacobiansWhereTheDirectionHasTurnedRound) {  // w2 < 0: the far side of infinity
  Random random(7);
  for (int i = 0; i < 10; ++i) {
    const Eigen::Vector3d a = in_front(random);
    const Eigen::Vector3d b = in_front(random);
    geometry::OrthonormalLine line = geometry::to_orthonormal(geometry::line_through(a, b));
    line.u.col(1) *= -1.0;
    line.u.col(2) *= -1.0;
    line.w2 *= -1.0;
    expect_line_jacobians(line_observation(random, a, b), random.pose(0.05, 0.05), line);
  }
}

TEST(LineRows, DepthIsMeasuredAlongTheRayOnly) {
  // A horizontal line at depth 2; measured endpoints 4 cm too far away, and off the line across it in the
  // image.
  const Eigen::Vector3d a(-0.5, 0.0, 2.0);
  const Eigen::Vector3d b(0.5, 0.0, 2.0);
  BundleLineObservation seen;
  seen.start = kTermCamera.project(a);
  seen.end = kTermCamera.project(b);
  seen.has_depth = true;
  seen.start_camera = a + Eigen::Vector3d(0.0, 0.01, 0.04);
  seen.end_camera = b + Eigen::Vector3d(0.2, 0.0, 0.04);  // along the line costs nothing
  seen.start_sigma = 0.02;
  seen.end_sigma = 0.04;
  const geometry::OrthonormalLine line = geometry::to_orthonormal(geometry::line_through(a, b));
  const Eigen::Vector4d r = line_rows(LineView(seen, kTermCamera), kProjection, {}, line, nullptr);
  EXPECT_NEAR(r(0), 0.0, 1e-9);
  EXPECT_NEAR(r(1), 0.0, 1e-9);
  EXPECT_NEAR(std::abs(r(2)), 2.0, 1e-9);
  EXPECT_NEAR(std::abs(r(3)), 1.0, 1e-9);
}

TEST(EdgeRows, Jacobians) {
  Random random(8);
  for (int i = 0; i < 20; ++i) {
    const Rigid3 a = random.pose(3.0, 2.0);
    const Rigid3 b = random.pose(3.0, 2.0);
    BundleEdge edge;
    edge.b_from_a = random.step(0.002, 0.001) * (b * a.inverse());
    const geometry::Matrix6d half = geometry::Matrix6d::Random();
    edge.information = half * half.transpose();
    if (i % 2 == 0) edge.information.col(2).setZero(), edge.information.row(2).setZero();
    const EdgeView view(edge);
    EdgeDerivatives j;
    const Vector6d r = edge_rows(view, a, b, &j);
    // J_l^-1 is taken to first order: right up to the square of the residual.
    const auto by_a = numeric_jacobian<6, 6>(
        [&](const Vector6d& xi) { return edge_rows(view, geometry::exp_se3(xi) * a, b, nullptr); });
    EXPECT_LT(relative(j.by_a, by_a), 1e-5);
    const auto by_b = numeric_jacobian<6, 6>(
        [&](const Vector6d& xi) { return edge_rows(view, a, geometry::exp_se3(xi) * b, nullptr); });
    EXPECT_LT(relative(j.by_b, by_b), 1e-5);
    EXPECT_EQ(r, edge_rows(view, a, b, nullptr));
  }
}

TEST(EdgeRows, CostIsTheInformationOfTheError) {
  Random random(9);
  const Rigid3 a = random.pose(3.0, 2.0);
  const Rigid3 b = random.pose(3.0, 2.0);
  Vector6d xi;
  xi << 0.1, -0.2, 0.05, 0.02, 0.03, -0.01;
  BundleEdge edge;
  edge.b_from_a = geometry::exp_se3(-xi) * (b * a.inverse());  // estimate * measured^-1 = Exp(xi)
  edge.information = geometry::Matrix6d::Identity();
  edge.information(0, 0) = 100.0;
  edge.information(4, 4) = 0.0;  // free
  const Vector6d r = edge_rows(EdgeView(edge), a, b, nullptr);
  EXPECT_NEAR(r.squaredNorm(), xi.dot(edge.information * xi), 1e-9);
}

}  // namespace
}  // namespace plumbline::optimize
