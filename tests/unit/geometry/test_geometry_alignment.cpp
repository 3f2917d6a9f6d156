// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <stdexcept>

#include "plumbline/geometry/alignment.hpp"
#include "random_world.hpp"

namespace plumbline::geometry {
namespace {

using Points = std::vector<Eigen::Vector3d>;

Points moved(const Rigid3& t, const Points& points) {
  Points result;
  for (const auto& p : points) result.push_back(t * p);
  return result;
}

TEST(AlignPoints, FindsAnExactMotion) {
  tests::Random random(1);
  for (int round = 0; round < 20; ++round) {
    Points source;
    for (int i = 0; i < 3 + round; ++i) source.push_back(random.vector(2.0));
    const Rigid3 truth = random.pose(3.1, 5.0);
    const Rigid3 found = align_points(source, moved(truth, source));
    EXPECT_LT((found.rotation - truth.rotation).norm(), 1e-9);
    EXPECT_LT((found.translation - truth.translation).norm(), 1e-9);
  }
}

TEST(AlignPoints, FlatSetsGiveARotationNotAMirror) {
  tests::Random random(2);
  Points source;
  for (int i = 0; i < 30; ++i) source.emplace_back(random.uniform(-1, 1), random.uniform(-1, 1), 0.0);
  const Rigid3 truth = random.pose(2.0, 1.0);
  Points target = moved(truth, source);
  for (auto& p : target) p += random.vector(1e-4);
  const Rigid3 found = align_points(source, target);
  EXPECT_NEAR(found.rotation.determinant(), 1.0, 1e-9);
  EXPECT_LT(rotation_angle(found.rotation * truth.rotation.transpose()), 1e-3);
}

TEST(AlignPoints, NoiseAveragesOut) {
  tests::Random random(3);
  Points source;
  for (int i = 0; i < 2000; ++i) source.push_back(random.vector(1.0));
  const Rigid3 truth = random.pose(2.0, 1.0);
  Points target = moved(truth, source);
  for (auto& p : target) p += Eigen::Vector3d(random.normal(0.05), random.normal(0.05), random.normal(0.05));
  const Rigid3 found = align_points(source, target);
  EXPECT_LT((found.translation - truth.translation).norm(), 0.006);  // 0.05 / sqrt(2000) is 1.1 mm
  EXPECT_LT(rotation_angle(found.rotation * truth.rotation.transpose()), 0.006);
}

TEST(AlignPoints, TooFewPointsGiveAShift) {
  EXPECT_TRUE(align_points({}, {}).translation.isZero());
  const Rigid3 one = align_points({{1, 2, 3}}, {{2, 2, 3}});
  EXPECT_TRUE(one.rotation.isIdentity());
  EXPECT_TRUE(one.translation.isApprox(Eigen::Vector3d(1, 0, 0)));
  const Rigid3 two = align_points({{0, 0, 0}, {1, 0, 0}}, {{0, 0, 1}, {1, 0, 1}});
  EXPECT_TRUE(two.rotation.isIdentity());
  EXPECT_TRUE(two.translation.isApprox(Eigen::Vector3d(0, 0, 1)));
}

TEST(AlignPoints, CollinearPointsAreNotTwisted) {
  tests::Random random(4);
  for (int round = 0; round < 20; ++round) {
    const Eigen::Vector3d start = random.vector(2.0);
    const Eigen::Vector3d direction = random.direction();
    Points source;
    for (int i = 0; i < 10; ++i) source.push_back(start + 0.3 * i * direction);
    const Eigen::Vector3d shift(0.1, 0.2, 0.3);
    const Rigid3 shifted = align_points(source, moved({Eigen::Matrix3d::Identity(), shift}, source));
    EXPECT_LT(rotation_angle(shifted.rotation), 1e-6);
    EXPECT_LT((shifted.translation - shift).norm(), 1e-6);

    const Rigid3 truth = random.pose(3.0, 1.0);
    const Points target = moved(truth, source);
    const Rigid3 found = align_points(source, target);
    EXPECT_NEAR(found.rotation.determinant(), 1.0, 1e-9);
    for (std::size_t i = 0; i < source.size(); ++i) EXPECT_LT((found * source[i] - target[i]).norm(), 1e-6);
  }
}

TEST(AlignPoints, CoincidentPointsGiveAShift) {
  const Points source(5, Eigen::Vector3d(1, 1, 1));
  const Points target(5, Eigen::Vector3d(1, 1, 3));
  const Rigid3 found = align_points(source, target);
  EXPECT_LT(rotation_angle(found.rotation), 1e-9);
  EXPECT_LT((found.translation - Eigen::Vector3d(0, 0, 2)).norm(), 1e-9);
}

TEST(AlignPoints, DifferentSizesAreABrokenCall) {
  EXPECT_THROW(align_points({{0, 0, 0}}, {}), std::invalid_argument);
}

}  // namespace
TEST(AlignPointsScaled, FindsScaleRotationAndShift) {
  const Rigid3 motion(exp_so3({0.3, -1.2, 0.5}), {1.0, -2.0, 3.0});
  std::vector<Eigen::Vector3d> source{{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0.5, 0.3, 1.5}, {-1, 0.4, 0.2}};
  std::vector<Eigen::Vector3d> target;
  for (const Eigen::Vector3d& p : source) target.push_back(motion * (0.95 * p));
  const geometry::ScaledRigid3 found = geometry::align_points_scaled(source, target);
  EXPECT_NEAR(found.scale, 0.95, 1e-12);
  EXPECT_LT((found.rigid.rotation - motion.rotation).norm(), 1e-12);
  EXPECT_LT((found.rigid.translation - motion.translation).norm(), 1e-12);
  EXPECT_LT((found * source[3] - target[3]).norm(), 1e-12);
}

TEST(AlignPointsScaled, OfALineAndOfOnePlace) {
  const std::vector<Eigen::Vector3d> line{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {4, 0, 0}};
  std::vector<Eigen::Vector3d> longer;
  for (const Eigen::Vector3d& p : line) longer.emplace_back(1.0, 2.0 * p.x(), 0.0);
  EXPECT_NEAR(geometry::align_points_scaled(line, longer).scale, 2.0, 1e-12);

  const std::vector<Eigen::Vector3d> one(4, Eigen::Vector3d(1.0, 2.0, 3.0));
  const geometry::ScaledRigid3 still = geometry::align_points_scaled(one, line);
  EXPECT_EQ(still.scale, 1.0);
  EXPECT_LT((still * one[0] - Eigen::Vector3d(1.75, 0, 0)).norm(), 1e-12);
  EXPECT_EQ(geometry::align_points_scaled({}, {}).scale, 1.0);
}

}  // namespace plumbline::geometry
