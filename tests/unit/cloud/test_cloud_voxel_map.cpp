// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cstring>

#include "plumbline/cloud/fusion/voxel_map.hpp"
#include "test_cloud_worlds.hpp"

namespace plumbline::cloud {
namespace {

using geometry::Rigid3;
using worlds::point;

constexpr float kMissing = std::numeric_limits<float>::quiet_NaN();

VoxelMapOptions voxels(double size) {
  VoxelMapOptions options;
  options.voxel_m = size;
  return options;
}

Cloud single(const Point& p) {
  Cloud cloud;
  cloud.push_back(p);
  return cloud;
}

/// `camera` looks at the wall z = 0 of the world from `distance` on the side of -z (or +z when turned).
Rigid3 looking(double distance, bool from_behind = false) {
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  if (from_behind) turn.diagonal() << -1, 1, -1;
  return {turn, Eigen::Vector3d(0, 0, from_behind ? distance : -distance)};
}

double weight(double z) {
  const double ratio = sensor::depth_sigma(1.0) / sensor::depth_sigma(z);
  return ratio * ratio;
}

TEST(VoxelMap, WeightsAreInverseVariances) {
  VoxelMap map(voxels(0.1));
  map.insert(single(point(0.01F, 0.01F, 1.02F, {0, 0, -1}, 40)), looking(1.0));
  map.insert(single(point(0.01F, 0.01F, 3.06F, {0, 0, -1}, 200)), looking(3.0));
  const auto fused = map.extract();
  ASSERT_EQ(fused.cloud->size(), 1U);
  const double near = weight(1.02);
  const double far = weight(3.06);
  const Point& p = (*fused.cloud)[0];
  EXPECT_NEAR(p.z, (near * 0.02 + far * 0.06) / (near + far), 2e-5);
  EXPECT_NEAR(p.r, (near * 40 + far * 200) / (near + far), 1.5);
  EXPECT_NEAR(p.normal_z, -1.0F, 1e-4F);
  EXPECT_EQ(fused.columns.observations[0], 2U);
  const double total = near + far;
  EXPECT_NEAR(fused.columns.confidence[0], total / (total + 1.0), 1e-3);
  const double spread = std::sqrt(near * far) / total * 0.04;
  EXPECT_NEAR(map.points()[0].spread_m, spread, 2e-4);
}

TEST(VoxelMap, AnObliqueMeasurementCountsItsCosine) {
  VoxelMap map(voxels(0.1));
  const Eigen::Vector3f oblique(std::sqrt(0.75F), 0, -0.5F);
  map.insert(single(point(0, 0, 1.02F)), looking(1.0));
  map.insert(single(point(0, 0, 1.08F, oblique)), looking(1.0));
  const auto fused = map.extract();
  ASSERT_EQ(fused.cloud->size(), 1U);
  const double a = weight(1.02);
  const double b = 0.5 * weight(1.08);
  EXPECT_NEAR((*fused.cloud)[0].z, (a * 0.02 + b * 0.08) / (a + b), 1e-4);
}

TEST(VoxelMap, OneViewIsOneObservationHoweverManyPoints) {
  VoxelMap map(voxels(0.1));
  Cloud cloud;
  for (int i = 0; i < 10; ++i) cloud.push_back(point(0.001F * static_cast<float>(i), 0.01F, 1.01F));
  map.insert(cloud, looking(1.0));
  EXPECT_EQ(map.extract().columns.observations, (std::vector<std::uint32_t>{1}));
  map.insert(cloud, looking(1.0));
  EXPECT_EQ(map.extract().columns.observations, (std::vector<std::uint32_t>{2}));
}

TEST(VoxelMap, AThinWallSeenFromBothRoomsHasTwoSides) {
  VoxelMap map(voxels(0.05));
  for (int i = 0; i < 5; ++i) {
    map.insert(single(point(0.02F, 0.02F, 1.01F, {0, 0, -1}, 10)), looking(1.0));
    map.insert(single(point(-0.02F, 0.02F, 0.98F, {0, 0, -1}, 200)), looking(1.0, true));
  }
  const auto fused = map.extract();
  ASSERT_EQ(fused.cloud->size(), 2U);
  EXPECT_NEAR((*fused.cloud)[0].normal_z, -1.0F, 1e-4F);
  EXPECT_NEAR((*fused.cloud)[0].z, 0.01F, 1e-4F);
  EXPECT_EQ((*fused.cloud)[0].r, 10);
  EXPECT_NEAR((*fused.cloud)[1].normal_z, 1.0F, 1e-4F);
  EXPECT_NEAR((*fused.cloud)[1].z, 0.02F, 1e-4F);
  EXPECT_EQ((*fused.cloud)[1].r, 200);
  EXPECT_EQ(fused.columns.observations, (std::vector<std::uint32_t>{5, 5}));
}

TEST(VoxelMap, PointsWithoutNormalTakeTheSideTheyAreSeenFrom) {
  VoxelMap map(voxels(0.05));
  const Eigen::Vector3f unknown(kMissing, kMissing, kMissing);
  map.insert(single(point(0.02F, 0.02F, 1.01F, unknown)), looking(1.0));
  map.insert(single(point(-0.02F, 0.02F, 0.98F, unknown)), looking(1.0, true));
  map.insert(single(point(0.02F, 0.02F, 1.01F)), looking(1.0));
  const auto fused = map.extract();
  ASSERT_EQ(fused.cloud->size(), 2U);
  EXPECT_NEAR((*fused.cloud)[0].normal_z, -1.0F, 1e-4F);
  EXPECT_TRUE(std::isnan((*fused.cloud)[1].normal_z));
}

TEST(VoxelMap, PassesOverWhatIsNoMeasurement) {
  VoxelMap map(voxels(0.01));
  Cloud cloud;
  cloud.push_back(point(kMissing, 0, 1));
  cloud.push_back(point(0, 0, 0));
  cloud.push_back(point(0, 0, -1));
  cloud.push_back(point(0, 0, 1, {1, 0, 0}));
  map.insert(cloud, Rigid3());
  map.insert(Cloud(), Rigid3());
  EXPECT_EQ(map.size(), 0U);
  EXPECT_TRUE(map.extract().cloud->empty());
  map.insert(single(point(0, 0, 1)), Rigid3(Eigen::Matrix3d::Identity(), Eigen::Vector3d(1e6, 0, 0)));
  EXPECT_EQ(map.size(), 0U) << "out of reach";
}

/// Random points seen from a few places.
VoxelMap random_map(int views) {
  VoxelMap map(voxels(0.02));
  std::mt19937 random(9);
  std::uniform_real_distribution<float> uniform(-1.0F, 1.0F);
  for (int view = 0; view < views; ++view) {
    Cloud cloud;
    for (int i = 0; i < 3000; ++i) {
      cloud.push_back(point(uniform(random), uniform(random), 1.5F + 0.01F * uniform(random)));
    }
    map.insert(cloud, Rigid3(Eigen::Matrix3d::Identity(), Eigen::Vector3d(0.3 * view, -0.1 * view, 0)));
  }
  return map;
}

TEST(VoxelMap, SameInsertsGiveSameBytesInAFixedOrder) {
  const auto a = random_map(4).extract();
  const auto b = random_map(4).extract();
  ASSERT_EQ(a.cloud->size(), b.cloud->size());
  EXPECT_EQ(std::memcmp(a.cloud->points.data(), b.cloud->points.data(), a.cloud->size() * sizeof(Point)), 0);
  EXPECT_EQ(a.columns.confidence, b.columns.confidence);
  EXPECT_TRUE(a.columns.robot.empty()) << "nobody asked";
  const auto cell = [](const Point& p) {
    return std::array<int, 3>{static_cast<int>(std::floor(p.x / 0.02F)),
                              static_cast<int>(std::floor(p.y / 0.02F)),
                              static_cast<int>(std::floor(p.z / 0.02F))};
  };
  std::size_t descents = 0;
  for (std::size_t i = 1; i < a.cloud->size(); ++i)
    descents += cell((*a.cloud)[i]) < cell((*a.cloud)[i - 1]) ? 1U : 0U;
  EXPECT_LE(descents, a.cloud->size() / 500) << "only rounding at a cell's border may look like a descent";
}

TEST(VoxelMap, FusedPointsGoIntoLargerVoxels) {
  VoxelMap fine(voxels(0.01));
  Cloud cloud;
  for (int i = 0; i < 10; ++i) cloud.push_back(point(0.01F * static_cast<float>(i) + 0.005F, 0.005F, 1.005F));
  fine.insert(cloud, looking(1.0));
  fine.insert(cloud, looking(1.0));
  ASSERT_EQ(fine.size(), 10U);
  const std::vector<FusedPoint> fused = VoxelMap::merged(fine.points(), voxels(1.0));
  ASSERT_EQ(fused.size(), 1U);
  EXPECT_EQ(fused[0].observations, 2U) << "no view is counted twice";
  EXPECT_NEAR(fused[0].point.x, 0.05F, 1e-4F);
  EXPECT_NEAR(fused[0].point.z, 0.005F, 1e-4F);
  float weight = 0.0F;
  for (const FusedPoint& one : fine.points()) weight += one.weight;
  EXPECT_NEAR(fused[0].weight, weight, 1e-4F * weight);
}

TEST(VoxelMap, TellsWhoMeasuredAPointMost) {
  VoxelMap map(voxels(0.1));
  const Eigen::AlignedBox3i everywhere(Eigen::Vector3i::Constant(-100), Eigen::Vector3i::Constant(100));
  const auto seen_by = [&](std::uint8_t robot, int views) {
    const Cloud cloud = single(point(0.01F, 0.01F, 1.02F, {0, 0, -1}, 40));
    for (int i = 0; i < views; ++i)
      map.insert(VoxelMap::measured(cloud, looking(1.0), voxels(0.1), robot), everywhere);
  };
  seen_by(0, 2);
  seen_by(3, 4);
  seen_by(1, 1);
  const std::vector<FusedPoint> fused = map.points();
  ASSERT_EQ(fused.size(), 1U);
  EXPECT_EQ(fused[0].robot, 3U);
  EXPECT_EQ(fused[0].observations, 7U);
  const std::vector<FusedPoint> settled = VoxelMap::merged(fused, voxels(0.1));
  EXPECT_EQ(settled[0].robot, 3U);
  EXPECT_EQ(settled[0].observations, 7U);
}

TEST(VoxelMap, AViewIsTakenUpAsFarAsItLiesInTheRegion) {
  Cloud cloud = single(point(0.01F, 0.01F, 1.02F));
  cloud.push_back(point(0.31F, 0.01F, 1.02F));
  cloud.push_back(point(0.41F, 0.01F, 1.02F));
  const std::vector<VoxelSample> view = VoxelMap::measured(cloud, looking(1.0), voxels(0.1));
  ASSERT_EQ(view.size(), 3U);
  EXPECT_EQ(view[1].voxel, Eigen::Vector3i(3, 0, 0));
  VoxelMap map(voxels(0.1));
  map.insert(view, Eigen::AlignedBox3i(Eigen::Vector3i(1, 0, 0), Eigen::Vector3i(3, 0, 0)));
  ASSERT_EQ(map.size(), 1U);
  EXPECT_NEAR(map.points()[0].point.x, 0.31F, 1e-5F);
}

}  // namespace
}  // namespace plumbline::cloud
