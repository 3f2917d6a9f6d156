// SPDX-License-Identifier: BSD-3-Clause
// Surfaces as PCL's registration loop sees them: voxel filter, neighbours, correspondences and steps.
#include <gtest/gtest.h>
#include <pcl/registration/icp.h>

#include <limits>

#include "plumbline/cloud/registration/constrained_point_to_plane.hpp"
#include "plumbline/cloud/registration/two_way_correspondences.hpp"
#include "random_world.hpp"

namespace plumbline::cloud {
namespace {

using geometry::Rigid3;
using tests::Random;

/// Points on a wall from `corner` along `u` and `v`, with 3 mm of noise.
void add_wall(SurfaceCloud& cloud, const Eigen::Vector3f& corner, const Eigen::Vector3f& u,
              const Eigen::Vector3f& v, Random& random, int count) {
  const Eigen::Vector3f normal = u.cross(v).normalized();
  for (int i = 0; i < count; ++i) {
    SurfacePoint p;
    p.getVector3fMap() = corner + static_cast<float>(random.uniform(0, 1)) * u +
                         static_cast<float>(random.uniform(0, 1)) * v +
                         static_cast<float>(0.003 * random.normal()) * normal;
    p.getNormalVector3fMap() = normal;
    p.curvature = 0.003F;
    cloud.push_back(p);
  }
}
SurfaceCloud corridor(Random& random) {
  SurfaceCloud cloud;
  add_wall(cloud, {-2, -1, 1}, {4, 0, 0}, {0, 0, 2}, random, 3000);
  add_wall(cloud, {-2, 1, 1}, {0, 0, 2}, {4, 0, 0}, random, 3000);
  add_wall(cloud, {-2, -1, 1}, {0, 2, 0}, {4, 0, 0}, random, 3000);
  return cloud;
}
SurfaceCloud dead_end(Random& random) {
  SurfaceCloud cloud = corridor(random);
  add_wall(cloud, {2, -1, 1}, {0, 2, 0}, {0, 0, 2}, random, 3000);
  return cloud;
}
SurfaceSearch search_of(const SurfaceCloud& cloud) {
  return SurfaceSearch(std::make_shared<SurfaceCloud>(cloud));
}

Rigid3 registered(const SurfaceSearch& a, const SurfaceSearch& b, Rigid3 b_from_a) {
  const auto correspondences = std::make_shared<TwoWayCorrespondences>(a, b, 0.8F);
  const auto every_fifth = [](const SurfaceSearch& s) {
    pcl::Indices some;
    for (std::size_t i = 0; i < s.cloud()->size(); i += 5) some.push_back(static_cast<int>(i));
    return some;
  };
  correspondences->setSamples(every_fifth(a), every_fifth(b));
  const auto estimation = std::make_shared<ConstrainedPointToPlane>(0.02);
  for (const bool narrow : {false, true}) {
    estimation->setNarrow(narrow);
    pcl::IterativeClosestPointWithNormals<SurfacePoint, SurfacePoint, double> icp;
    icp.setInputSource(a.cloud());
    icp.setInputTarget(b.cloud());
    icp.setSearchMethodTarget(b.tree(), true);
    icp.setCorrespondenceEstimation(correspondences);
    icp.setTransformationEstimation(estimation);
    icp.setMaxCorrespondenceDistance(narrow ? 0.05 : 0.1);
    icp.setMaximumIterations(30);
    icp.setTransformationEpsilon(1e-8);
    SurfaceCloud moved;
    icp.align(moved, b_from_a.isometry().matrix());
    const Eigen::Matrix4d found = icp.getFinalTransformation();
    b_from_a = Rigid3(found.topLeftCorner<3, 3>(), found.topRightCorner<3, 1>());
  }
  return b_from_a;
}

TEST(Registration, FiveCentimetresAndTwoDegreesConverge) {
  for (std::uint32_t seed = 1; seed <= 3; ++seed) {
    Random random(seed);
    const SurfaceSearch a = search_of(dead_end(random));
    const SurfaceSearch b = search_of(dead_end(random));
    const Rigid3 found = registered(a, b, random.step(0.05, 0.035));
    const Eigen::Vector3d middle(0.0, 0.0, 2.0);
    EXPECT_LT((found * middle - middle).norm(), 0.002) << seed;
    EXPECT_LT(geometry::rotation_angle(found.rotation), 0.001) << seed;
  }
}

TEST(Registration, ACorridorDoesNotSlide) {
  Random random(2);
  const SurfaceSearch a = search_of(corridor(random));
  const SurfaceSearch b = search_of(corridor(random));
  const Rigid3 start(geometry::exp_so3({0.01, 0.0, 0.01}), {0.05, 0.03, -0.02});
  const Rigid3 found = registered(a, b, start);
  const Eigen::Vector3d middle(0.0, 0.0, 2.0);
  EXPECT_NEAR((found * middle).x(), (start * middle).x(), 0.002);
  EXPECT_NEAR((found * middle).y(), 0.0, 0.002);
  EXPECT_NEAR((found * middle).z(), 2.0, 0.002);
}

TEST(Registration, AWallHoldsThreeDirections) {
  Random random(3);
  SurfaceCloud wall;
  add_wall(wall, {-1, -1, 2}, {0, 2, 0}, {2, 0, 0}, random, 2000);
  pcl::Correspondences pairs;
  for (int i = 0; i < 2000; ++i) pairs.emplace_back(i, i, 0.0F);
  const PlaneStep step = ConstrainedPointToPlane(0.02).step(wall, wall, pairs);
  EXPECT_EQ(std::count(step.held.begin(), step.held.end(), true), 3);
  EXPECT_EQ(step.inliers, 2000);
  const PlaneStep nothing = ConstrainedPointToPlane(0.02).step(wall, wall, {});
  EXPECT_EQ(nothing.inliers, 0);
  EXPECT_TRUE(nothing.transformation.isIdentity(0.0));
}

TEST(VoxelFiltered, SidesStayApartHoweverFarTheCloudReaches) {
  SurfaceCloud cloud;
  const auto add = [&](float x, float nz) {
    SurfacePoint p;
    p.getVector3fMap() = Eigen::Vector3f(x, 0.01F, 0.01F);
    p.getNormalVector3fMap() = Eigen::Vector3f(0.0F, 0.0F, nz);
    p.curvature = 0.004F;
    cloud.push_back(p);
  };
  for (const float x : {0.01F, 0.02F}) add(x, 1.0F);
  add(0.015F, -1.0F);
  add(5000.0F, 1.0F);  // one grid over all would have more cells than can be counted
  add(std::numeric_limits<float>::quiet_NaN(), 1.0F);
  add(0.012F, std::numeric_limits<float>::quiet_NaN());
  const SurfaceCloud means = voxel_filtered(cloud, 0.03F, true);
  ASSERT_EQ(means.size(), 3U);
  int together = 0;
  for (const SurfacePoint& p : means) {
    if (p.x > 1.0F || p.normal_z < 0.0F) continue;
    ++together;
    EXPECT_NEAR(p.x, 0.015F, 1e-6F);
    EXPECT_NEAR(p.curvature, 0.004F / std::sqrt(2.0F), 1e-6F);
  }
  EXPECT_EQ(together, 1);
  EXPECT_TRUE(voxel_filtered({}, 0.03F, false).empty());
}

TEST(SurfaceSearch, NobodyIsNearWhatIsNowhere) {
  Random random(4);
  const SurfaceSearch search = search_of(dead_end(random));
  SurfacePoint p = search.cloud()->front();
  EXPECT_EQ(nearest_facing(*search.tree(), p, 0.05F, 0.8F), 0);
  p.getNormalVector3fMap() *= -1.0F;
  EXPECT_EQ(nearest_facing(*search.tree(), p, 0.05F, 0.8F), -1);
  p.x = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(nearest_facing(*search.tree(), p, 0.05F, 0.8F), -1);
  EXPECT_EQ(search_of({}).tree(), nullptr);
}

}  // namespace
}  // namespace plumbline::cloud
