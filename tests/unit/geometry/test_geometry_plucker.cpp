// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <Eigen/LU>

#include "numeric_jacobian.hpp"
#include "plumbline/geometry/plucker.hpp"
#include "random_world.hpp"

namespace plumbline::geometry {
namespace {

using tests::Random;

double distance_to(const PluckerLine& line, const Eigen::Vector3d& p) {
  return (p - nearest_point(line, p)).norm();
}

// The same line, whatever the scale and sense of (n, v).
double difference(const PluckerLine& a, const PluckerLine& b) {
  Eigen::Matrix<double, 6, 1> x;
  Eigen::Matrix<double, 6, 1> y;
  x << a.n, a.v;
  y << b.n, b.v;
  x.normalize();
  y.normalize();
  return std::min((x - y).norm(), (x + y).norm());
}

TEST(Plucker, LineHoldsItsTwoPoints) {
  Random random(1);
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d a = random.vector(5.0);
    const Eigen::Vector3d b = random.vector(5.0);
    const PluckerLine line = line_through(a, b);
    EXPECT_NEAR(line.v.norm(), 1.0, 1e-14);
    EXPECT_NEAR(line.n.dot(line.v), 0.0, 1e-13);
    EXPECT_GT(line.v.dot(b - a), 0.0);
    EXPECT_LT((line.n - a.cross(line.v)).norm(), 1e-13);
    EXPECT_LT((line.n - b.cross(line.v)).norm(), 1e-12);
    EXPECT_LT(distance_to(line, a), 1e-12);
    EXPECT_LT(distance_to(line, b), 1e-12);
  }
}

TEST(Plucker, NearestPointIsTheFootOfThePerpendicular) {
  PluckerLine line = line_through({0, 0, 1}, {1, 0, 1});
  EXPECT_LT((nearest_point(line, {3.0, 4.0, 7.0}) - Eigen::Vector3d(3, 0, 1)).norm(), 1e-13);
  line.n *= 5.0;  // any scale
  line.v *= 5.0;
  EXPECT_LT((nearest_point(line, {3.0, 4.0, 7.0}) - Eigen::Vector3d(3, 0, 1)).norm(), 1e-13);
}

TEST(Plucker, TransformsLikeItsPoints) {
  Random random(2);
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d a = random.vector(5.0);
    const Eigen::Vector3d b = random.vector(5.0);
    const Rigid3 t = random.pose(3.1, 4.0);
    const PluckerLine expected = line_through(t * a, t * b);
    const PluckerLine found = transform(t, line_through(a, b));
    EXPECT_LT((found.n - expected.n).norm(), 1e-11);
    EXPECT_LT((found.v - expected.v).norm(), 1e-12);
  }
}

TEST(Plucker, ProjectsLikeItsPoints) {
  Random random(3);
  const double fx = 520.0;
  const double fy = 540.0;
  const double cx = 318.0;
  const double cy = 250.0;
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d a(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(1, 4));
    const Eigen::Vector3d b(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(1, 4));
    Eigen::Vector3d l = line_projection(fx, fy, cx, cy) * line_through(a, b).n;
    l /= l.head<2>().norm();  // now a distance in pixels
    for (const Eigen::Vector3d& p : {a, b}) {
      EXPECT_NEAR(l.dot(Eigen::Vector3d(fx * p.x() / p.z() + cx, fy * p.y() / p.z() + cy, 1.0)), 0.0, 1e-9);
    }
    EXPECT_GT(std::abs(l.dot(Eigen::Vector3d(fx * a.x() / a.z() + cx - 10.0 * l.x(),
                                             fy * a.y() / a.z() + cy - 10.0 * l.y(), 1.0))),
              9.9);
  }
}

TEST(Orthonormal, RoundTrip) {
  Random random(4);
  for (int i = 0; i < 50; ++i) {
    PluckerLine line = line_through(random.vector(5.0), random.vector(5.0));
    const OrthonormalLine o = to_orthonormal(line);
    EXPECT_LT((o.u.transpose() * o.u - Eigen::Matrix3d::Identity()).norm(), 1e-13);
    EXPECT_NEAR(o.u.determinant(), 1.0, 1e-13);
    EXPECT_NEAR(std::hypot(o.w1, o.w2), 1.0, 1e-14);
    EXPECT_NEAR(o.w1 / o.w2, line.n.norm(), 1e-11);  // the line's distance from the origin
    const PluckerLine back = to_plucker(o);
    EXPECT_NEAR(back.v.norm(), 1.0, 1e-13);
    EXPECT_LT((back.n - line.n).norm(), 1e-11);
    EXPECT_LT((back.v - line.v).norm(), 1e-12);
    line.n *= 3.0;  // the scale does not matter
    line.v *= 3.0;
    EXPECT_LT(difference(to_plucker(to_orthonormal(line)), back), 1e-12);
  }
}

TEST(Orthonormal, LineThroughTheOrigin) {
  const PluckerLine line = line_through({1, 2, 3}, {2, 4, 6});
  const OrthonormalLine o = to_orthonormal(line);
  EXPECT_TRUE(o.u.allFinite());
  EXPECT_LT((o.u.transpose() * o.u - Eigen::Matrix3d::Identity()).norm(), 1e-13);
  const PluckerLine back = to_plucker(o);
  EXPECT_LT(back.n.norm(), 1e-12);
  EXPECT_LT((back.v - line.v).norm(), 1e-12);
  // It can be moved off the origin: phi = 0.1 puts it at distance tan(0.1), whatever n was chosen.
  EXPECT_NEAR(to_plucker(update(o, {0, 0, 0, -0.1})).n.norm(), std::tan(0.1), 1e-12);
}

TEST(Orthonormal, LinesFarAwayAndAtInfinityStayFinite) {
  const PluckerLine far = line_through({0, 1e8, 0}, {1, 1e8, 0});
  const PluckerLine back = to_plucker(to_orthonormal(far));
  EXPECT_NEAR(back.n.norm() / 1e8, 1.0, 1e-9);
  EXPECT_LT((back.v - far.v).norm(), 1e-9);

  OrthonormalLine infinite;
  infinite.w1 = 1.0;
  infinite.w2 = 0.0;
  const PluckerLine at_infinity = to_plucker(infinite);
  EXPECT_TRUE(at_infinity.n.allFinite());
  EXPECT_TRUE(at_infinity.v.allFinite());
  EXPECT_GT(at_infinity.n.norm(), 1e9);
}

TEST(Orthonormal, UpdateKeepsTheForm) {
  Random random(5);
  OrthonormalLine line = to_orthonormal(line_through({1, 2, 3}, {0, 1, 5}));
  for (int i = 0; i < 1000; ++i) {
    Eigen::Vector4d delta;
    delta << random.vector(0.3), random.uniform(-0.3, 0.3);
    line = update(line, delta);
  }
  EXPECT_LT((line.u.transpose() * line.u - Eigen::Matrix3d::Identity()).norm(), 1e-10);
  EXPECT_NEAR(std::hypot(line.w1, line.w2), 1.0, 1e-14);
  const PluckerLine plucker = to_plucker(line);
  EXPECT_NEAR(plucker.n.dot(plucker.v), 0.0, 1e-9 * (1.0 + plucker.n.norm()));
  const OrthonormalLine same = update(line, Eigen::Vector4d::Zero());
  EXPECT_LT((same.u - line.u).norm(), 1e-14);
}

TEST(Orthonormal, PassingThroughInfinityTurnsTheDirectionRound) {
  OrthonormalLine line;
  line.w1 = std::cos(0.01);
  line.w2 = -std::sin(0.01);
  const PluckerLine plucker = to_plucker(line);
  PluckerLine unscaled{line.w1 * line.u.col(0), line.w2 * line.u.col(1)};
  EXPECT_LT(difference(plucker, unscaled), 1e-12);
  EXPECT_NEAR(plucker.v.norm(), 1.0, 1e-14);
}

TEST(Orthonormal, JacobianIsTheDerivativeOfUpdate) {
  Random random(6);
  for (int i = 0; i < 20; ++i) {
    OrthonormalLine line = to_orthonormal(line_through(random.vector(3.0), random.vector(3.0)));
    if (i == 0) line = to_orthonormal(line_through({0, 0, 0}, {1, 1, 0}));
    const auto numeric = tests::numeric_jacobian<6, 4>([&](const Eigen::Vector4d& delta) {
      const OrthonormalLine moved = update(line, delta);
      Eigen::Matrix<double, 6, 1> l;
      l << moved.w1 * moved.u.col(0), moved.w2 * moved.u.col(1);
      return l;
    });
    EXPECT_LT((orthonormal_jacobian(line) - numeric).cwiseAbs().maxCoeff(), 1e-8);
  }
}

}  // namespace
}  // namespace plumbline::geometry
