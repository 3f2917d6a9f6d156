// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "plumbline/geometry/rigid3.hpp"
#include "random_world.hpp"

namespace plumbline::geometry {
namespace {

using tests::Random;

const double kPi = std::acos(-1.0);

// The definition: sum of M^k / k! of the twist's 4x4 matrix.
Eigen::Matrix4d exponential_series(const Vector6d& xi) {
  Eigen::Matrix4d m = Eigen::Matrix4d::Zero();
  m.topLeftCorner<3, 3>() = skew(xi.tail<3>());
  m.topRightCorner<3, 1>() = xi.head<3>();
  Eigen::Matrix4d sum = Eigen::Matrix4d::Identity();
  Eigen::Matrix4d term = Eigen::Matrix4d::Identity();
  for (int k = 1; k < 40; ++k) {
    term = (term * m / k).eval();
    sum += term;
  }
  return sum;
}

double orthonormality_error(const Eigen::Matrix3d& r) {
  return (r.transpose() * r - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
}

class ExpLog : public testing::TestWithParam<double> {};

TEST_P(ExpLog, ExpIsTheMatrixExponential) {
  Random random(1);
  for (int i = 0; i < 20; ++i) {
    Vector6d xi;
    xi << random.vector(2.0), GetParam() * random.direction();
    const Eigen::Matrix4d expected = exponential_series(xi);
    const Rigid3 t = exp_se3(xi);
    EXPECT_LT((t.rotation - expected.topLeftCorner<3, 3>()).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_LT((t.translation - expected.topRightCorner<3, 1>()).cwiseAbs().maxCoeff(), 1e-10);
  }
}

TEST_P(ExpLog, LogUndoesExp) {
  Random random(2);
  for (int i = 0; i < 20; ++i) {
    Vector6d xi;
    xi << random.vector(2.0), GetParam() * random.direction();
    EXPECT_LT((log_se3(exp_se3(xi)) - xi).cwiseAbs().maxCoeff(), 1e-8) << "angle " << GetParam();
    EXPECT_NEAR(rotation_angle(exp_so3(xi.tail<3>())), GetParam(), 1e-9);
  }
}

INSTANTIATE_TEST_SUITE_P(Angles, ExpLog,
                         testing::Values(0.0, 1e-14, 1e-11, 1e-8, 0.9e-5, 1.1e-5, 1e-3, 0.5, 1.7, 3.0,
                                         kPi - 1e-3, kPi - 1e-6, kPi - 1e-8));

TEST(Rigid3, HalfTurnsHaveOneOfTheirTwoLogarithms) {
  Random random(3);
  for (int i = 0; i < 50; ++i) {
    Eigen::Vector3d axis = random.direction();
    if (i < 3) axis = Eigen::Vector3d::Unit(i);
    const Eigen::Matrix3d r = 2.0 * axis * axis.transpose() - Eigen::Matrix3d::Identity();  // exact half turn
    const Eigen::Vector3d phi = log_so3(r);
    EXPECT_NEAR(phi.norm(), kPi, 1e-9);
    EXPECT_LT((exp_so3(phi) - r).cwiseAbs().maxCoeff(), 1e-9);
  }
}

TEST(Rigid3, SkewIsTheCrossProduct) {
  const Eigen::Vector3d a(0.3, -2.0, 1.1);
  const Eigen::Vector3d b(-0.7, 0.2, 5.0);
  EXPECT_LT((skew(a) * b - a.cross(b)).norm(), 1e-15);
}

TEST(Rigid3, ProductsAndInverseActOnPoints) {
  Random random(4);
  const Rigid3 a = random.pose(3.0, 2.0);
  const Rigid3 b = random.pose(3.0, 2.0);
  const Eigen::Vector3d p = random.vector(3.0);
  EXPECT_LT(((a * b) * p - a * (b * p)).norm(), 1e-13);
  EXPECT_LT((a.inverse() * (a * p) - p).norm(), 1e-13);
  EXPECT_LT((a.isometry() * p - a * p).norm(), 1e-13);
}

TEST(Rigid3, QuaternionIsUnitWithPositiveW) {
  Random random(5);
  for (int i = 0; i < 100; ++i) {
    const Rigid3 a = random.pose(kPi, 1.0);
    const Eigen::Quaterniond q = a.quaternion();
    EXPECT_NEAR(q.norm(), 1.0, 1e-14);
    EXPECT_GE(q.w(), 0.0);
    EXPECT_LT((q.toRotationMatrix() - a.rotation).cwiseAbs().maxCoeff(), 1e-14);
  }
}

TEST(Rigid3, AHundredThousandProductsStayARotation) {
  Random random(6);
  Rigid3 chain;
  const Rigid3 step = random.pose(0.3, 0.01);
  for (int i = 0; i < 100000; ++i) chain = chain * step;
  EXPECT_LT(orthonormality_error(chain.rotation), 1e-14);
  EXPECT_NEAR(chain.rotation.determinant(), 1.0, 1e-14);
  // Many equal steps are one step of many times the logarithm.
  const Vector6d xi = 100000.0 * log_se3(step);
  EXPECT_LT((exp_se3(xi).rotation - chain.rotation).cwiseAbs().maxCoeff(), 1e-8);
  EXPECT_LT((exp_se3(xi).translation - chain.translation).norm(), 1e-7);
}

TEST(Rigid3, ProductsPullASkewedRotationBack) {
  Rigid3 a;
  a.rotation = exp_so3({0.2, 0.4, -0.1}) * (Eigen::Matrix3d::Identity() + 1e-4 * Eigen::Matrix3d::Ones());
  ASSERT_GT(orthonormality_error(a.rotation), 1e-4);
  const Rigid3 once = a * Rigid3();
  EXPECT_LT(orthonormality_error(once.rotation), 1e-6);
  EXPECT_LT(orthonormality_error((once * Rigid3()).rotation), 1e-12);
}

TEST(Rigid3, InterpolatesFromEndToEnd) {
  Random random(7);
  for (int i = 0; i < 50; ++i) {
    const Rigid3 a = random.pose(kPi, 2.0);
    const double turn = random.uniform(0.0, 3.0);
    const Rigid3 b(a.rotation * exp_so3(turn * random.direction()), random.vector(2.0));
    EXPECT_LT(tests::angle(interpolate(a, b, 0.0), a), 1e-7);
    EXPECT_LT(tests::angle(interpolate(a, b, 1.0), b), 1e-7);
    const Rigid3 quarter = interpolate(a, b, 0.25);  // the short way round, at constant speed
    EXPECT_NEAR(tests::angle(quarter, a), 0.25 * turn, 1e-7);
    EXPECT_NEAR(tests::angle(quarter, b), 0.75 * turn, 1e-7);
    EXPECT_LT((quarter.translation - (0.75 * a.translation + 0.25 * b.translation)).norm(), 1e-14);
  }
}

}  // namespace
}  // namespace plumbline::geometry
