// SPDX-License-Identifier: BSD-3-Clause
// Surfaces of known shape, moved against each other by a known step.
#include <gtest/gtest.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>

#include "plumbline/mapping/registration/local_map_alignment.hpp"
#include "random_world.hpp"

namespace plumbline::mapping {
namespace {

using core::KeyframeId;
using geometry::Rigid3;
using geometry::Vector6d;
using tests::Random;

constexpr float kNoise_m = 0.004F;

/// Samples of the rectangle corner + s u + t v, s and t in [0, 1], each its own draw of noise along the
/// normal.
void add_wall(CoarseSurface& surface, const Eigen::Vector3f& corner, const Eigen::Vector3f& u,
              const Eigen::Vector3f& v, Random& random, int samples = 1500) {
  const Eigen::Vector3f normal = u.cross(v).normalized();
  for (int i = 0; i < samples; ++i) {
    const auto s = static_cast<float>(random.uniform(0.0, 1.0));
    const auto t = static_cast<float>(random.uniform(0.0, 1.0));
    const auto noise = static_cast<float>(random.normal(static_cast<double>(kNoise_m)));
    surface.push_back({corner + s * u + t * v + noise * normal, normal, kNoise_m});
  }
}

/// Two walls that face each other and a floor: 3 m long in x, nothing along it.
CoarseSurface corridor(Random& random) {
  CoarseSurface surface;
  add_wall(surface, {-1.5F, -1, 1}, {3, 0, 0}, {0, 0, 2}, random);
  add_wall(surface, {-1.5F, 1, 1}, {0, 0, 2}, {3, 0, 0}, random);
  add_wall(surface, {-1.5F, -1, 3}, {3, 0, 0}, {0, 2, 0}, random);
  return surface;
}
CoarseSurface dead_end(Random& random) {
  CoarseSurface surface = corridor(random);
  add_wall(surface, {1.5F, -1, 1}, {0, 0, 2}, {0, 2, 0}, random);
  return surface;
}
CoarseSurface moved(const CoarseSurface& surface, const Rigid3& target_from_surface) {
  CoarseSurface result;
  for (const maps::SurfaceSample& s : surface) {
    result.push_back({(target_from_surface * s.point.cast<double>()).cast<float>(),
                      (target_from_surface.rotation * s.normal.cast<double>()).cast<float>(), s.sigma});
  }
  return result;
}

TEST(AlignSurfaces, FindsTheStepBetweenTwoViewsOfOneCorner) {
  for (std::uint32_t seed = 1; seed <= 5; ++seed) {
    Random random(seed);
    const Rigid3 truth = random.pose(0.5, 1.0);
    const cloud::SurfaceSearch a = search_of(dead_end(random));
    const cloud::SurfaceSearch b = search_of(moved(dead_end(random), truth));
    const SurfaceAlignment found = align_surfaces(a, b, random.step(0.04, 0.02) * truth, {});
    EXPECT_EQ(found.refused, "") << "seed " << seed;
    EXPECT_EQ(found.held, 6);
    EXPECT_GT(found.overlap, 0.8);
    EXPECT_NEAR(found.rms, 1.0, 0.3);
    EXPECT_LT(tests::angle(found.b_from_a, truth), 0.001);
    EXPECT_LT((found.b_from_a * Eigen::Vector3d(0, 0, 2) - truth * Eigen::Vector3d(0, 0, 2)).norm(), 0.001);
    const Vector6d error = geometry::log_se3(truth * found.b_from_a.inverse());
    EXPECT_LT(error.dot(found.information * error), 22.5);  // chi-square of 6 dimensions, 99.9 %
  }
}

TEST(AlignSurfaces, OverlapIsThatOfTheEndHoweverFarApartItBegan) {
  Random random(7);
  const cloud::SurfaceSearch a = search_of(dead_end(random));
  const cloud::SurfaceSearch b = search_of(dead_end(random));
  const SurfaceAlignment found =
      align_surfaces(a, b, Rigid3(geometry::exp_so3({0.0, 0.0, 0.02}), {0.09, 0.11, 0.03}), {});
  EXPECT_EQ(found.refused, "");
  EXPECT_GT(found.overlap, 0.8);
  EXPECT_LT(found.b_from_a.translation.norm(), 0.002);
}

TEST(AlignSurfaces, ACorridorDoesNotSlide) {
  Random random(2);
  const cloud::SurfaceSearch a = search_of(corridor(random));
  const cloud::SurfaceSearch b = search_of(corridor(random));
  const Rigid3 start(geometry::exp_so3({0.01, 0.0, 0.01}), {0.05, 0.03, -0.02});
  const SurfaceAlignment found = align_surfaces(a, b, start, {});
  EXPECT_EQ(found.refused, "");
  EXPECT_EQ(found.held, 5);
  const Eigen::Vector3d middle(0.0, 0.0, 2.0);
  EXPECT_NEAR((found.b_from_a * middle).x(), (start * middle).x(), 0.002);
  EXPECT_NEAR(found.b_from_a.translation.y(), 0.0, 0.001);
  Vector6d along = Vector6d::Zero();
  along(0) = 1.0;
  Vector6d across = Vector6d::Zero();
  across(1) = 1.0;
  EXPECT_LT(along.dot(found.information * along), 1e-3 * across.dot(found.information * across));
}

TEST(AlignSurfaces, OneWallHoldsThreeDirections) {
  Random random(3);
  CoarseSurface wall;
  add_wall(wall, {-1, -1, 2}, {0, 2, 0}, {2, 0, 0}, random, 3000);
  const cloud::SurfaceSearch a = search_of(wall);
  const SurfaceAlignment found =
      align_surfaces(a, a, Rigid3(Eigen::Matrix3d::Identity(), {0.02, 0, 0.03}), {});
  EXPECT_EQ(found.held, 3);
  EXPECT_NEAR(found.b_from_a.translation.z(), 0.0, 1e-4);
  EXPECT_NEAR(found.b_from_a.translation.x(), 0.02, 1e-3);
}

TEST(AlignSurfaces, WhatDoesNotBelongTogetherIsRefused) {
  Random random(4);
  const cloud::SurfaceSearch a = search_of(dead_end(random));
  const cloud::SurfaceSearch nothing = search_of({});
  EXPECT_NE(align_surfaces(a, nothing, {}, {}).refused, "");
  EXPECT_NE(align_surfaces(nothing, nothing, {}, {}).refused, "");
  const Rigid3 far(Eigen::Matrix3d::Identity(), {9.0, 0.0, 0.0});
  EXPECT_NE(align_surfaces(a, a, far, {}).refused, "");
  // The back of a wall is not its front.
  CoarseSurface front;
  add_wall(front, {-1, -1, 2}, {0, 2, 0}, {2, 0, 0}, random);
  CoarseSurface back;
  add_wall(back, {-1, -1, 2}, {2, 0, 0}, {0, 2, 0}, random);
  EXPECT_NE(align_surfaces(search_of(front), search_of(back), {}, {}).refused, "");
  AlignmentOptions careful;
  careful.max_shift_m = 0.01;
  const Rigid3 off(Eigen::Matrix3d::Identity(), {0.05, 0.0, 0.0});
  const SurfaceAlignment moved_too_far = align_surfaces(a, a, off, careful);
  EXPECT_NE(moved_too_far.refused, "");
  EXPECT_NEAR(moved_too_far.shift_m, 0.05, 0.005);
}

TEST(SurfaceSearch, FindsTheNearestThatFacesTheSameWay) {
  Random random(5);
  CoarseSurface surface;
  for (int i = 0; i < 3000; ++i) {
    const Eigen::Vector3d normal =
        Eigen::Vector3d(0.0, 0.0, i % 2 == 0 ? 1.0 : -1.0) + 0.2 * random.direction();
    surface.push_back({random.vector(1.0).cast<float>(), normal.normalized().cast<float>(), 0.01F});
  }
  const cloud::SurfaceSearch search = search_of(surface);
  int found = 0, missed = 0;
  for (int i = 0; i < 500; ++i) {
    cloud::SurfacePoint p;
    p.getVector3fMap() = random.vector(1.2).cast<float>();
    p.getNormalVector3fMap() = Eigen::Vector3f::UnitZ();
    float best = 0.08F;
    int expected = -1;
    for (std::size_t k = 0; k < surface.size(); ++k) {
      const float d = (surface[k].point - p.getVector3fMap()).norm();
      if (d < best && surface[k].normal.dot(p.getNormalVector3fMap()) >= 0.3F) {
        best = d;
        expected = static_cast<int>(k);
      }
    }
    EXPECT_EQ(cloud::nearest_facing(*search.tree(), p, 0.08F, 0.3F), expected);
    ++(expected >= 0 ? found : missed);
  }
  EXPECT_GT(found, 50);
  EXPECT_GT(missed, 50);
}

TEST(SurfaceSearch, WhatIsNowhereFindsNothing) {
  const cloud::SurfaceSearch search = search_of({{{0.0F, 0.0F, 1.0F}, Eigen::Vector3f::UnitZ(), 0.01F}});
  cloud::SurfacePoint p;
  p.getVector3fMap().setConstant(std::numeric_limits<float>::quiet_NaN());
  p.getNormalVector3fMap() = Eigen::Vector3f::UnitZ();
  EXPECT_EQ(cloud::nearest_facing(*search.tree(), p, 0.1F, 0.5F), -1);
  EXPECT_EQ(search_of({}).tree(), nullptr);
}

/// In the order of voxels and the ways they face, as far as that can be told without PCL.
TEST(CoarseSurface, IsTheMeanOfEachVoxelAndFacing) {
  Random random(9);
  cloud::Cloud cloud;
  struct Sum {
    Eigen::Vector3d point{0, 0, 0};
    Eigen::Vector3d normal{0, 0, 0};
    double sigma = 0.0;
    int count = 0;
  };
  std::map<std::array<int, 4>, Sum> sums;
  const auto key_of = [](const Eigen::Vector3f& at, const Eigen::Vector3f& normal) {
    Eigen::Index axis = 0;
    normal.cwiseAbs().maxCoeff(&axis);
    std::array<int, 4> key{};
    for (std::size_t k = 0; k < 3; ++k)
      key[k] = static_cast<int>(std::floor(at[static_cast<Eigen::Index>(k)] / 0.1F));
    key[3] = static_cast<int>(2 * axis) + (normal[axis] < 0.0F ? 1 : 0);
    return key;
  };
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector3f at = random.vector(0.3).cast<float>() + Eigen::Vector3f(0.0F, 0.0F, 1.0F);
    const Eigen::Vector3f normal = random.direction().cast<float>();
    cloud::Point p;
    p.getVector3fMap() = at;
    p.getNormalVector3fMap() = normal;
    cloud.points.push_back(p);
    const double depth_sigma = 0.0012 + 0.0019 * (at.z() - 0.4) * (at.z() - 0.4);
    Sum& sum = sums[key_of(at, normal)];
    sum.point += at.cast<double>();
    sum.normal += normal.cast<double>();
    sum.sigma += 0.5 * depth_sigma * std::max(0.3, -static_cast<double>(normal.z()));
    ++sum.count;
  }
  const CoarseSurface surface = coarse_surface(cloud, 0.1);
  ASSERT_EQ(surface.size(), sums.size());
  for (const maps::SurfaceSample& s : surface) {
    const auto found = sums.find(key_of(s.point, s.normal));
    ASSERT_NE(found, sums.end());
    const Sum& sum = found->second;
    EXPECT_LT((s.point.cast<double>() - sum.point / sum.count).norm(), 1e-5);
    EXPECT_LT((s.normal.cast<double>() - sum.normal.normalized()).norm(), 1e-4);
    EXPECT_NEAR(static_cast<double>(s.sigma), sum.sigma / sum.count, 1e-6);
  }
}

TEST(CoarseSurface, MeansOfVoxelsWithoutWhatIsNotKnown) {
  cloud::Cloud cloud;
  const auto add = [&](float x, float z, float nz) {
    cloud::Point p;
    p.x = x;
    p.y = 0.0F;
    p.z = z;
    p.normal_x = p.normal_y = 0.0F;
    p.normal_z = nz;
    cloud.points.push_back(p);
  };
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  add(0.011F, 2.01F, -1.0F);
  add(0.013F, 2.02F, -1.0F);
  add(0.012F, 2.015F, 1.0F);  // the other side of the same voxel
  add(0.31F, 2.01F, kNan);
  add(kNan, 2.01F, -1.0F);
  const CoarseSurface surface = coarse_surface(cloud, 0.1);
  ASSERT_EQ(surface.size(), 2U);
  const maps::SurfaceSample& front = surface[0].normal.z() < 0.0F ? surface[0] : surface[1];
  EXPECT_NEAR(front.point.x(), 0.012F, 1e-5F);
  EXPECT_NEAR(front.point.z(), 2.015F, 1e-3F);
  EXPECT_GT(front.sigma, 0.001F);
  EXPECT_TRUE(coarse_surface({}, 0.1).empty());
}

/// A camera that goes along a corridor with a dead end and comes back.
struct Walk {
  maps::Map map;
  std::map<KeyframeId, CoarseSurface> surfaces;
  Walk() {
    Random random(6);
    const CoarseSurface world = dead_end(random);
    for (int k = 0; k < 20; ++k) {
      const double x = 0.3 * (k < 10 ? k : 19 - k);
      const Rigid3 camera_from_world(Eigen::Matrix3d::Identity(), {x, 0.0, 0.0});
      auto keyframe = std::make_shared<maps::Keyframe>();
      keyframe->id = {0, k};
      map.add_keyframe(keyframe, camera_from_world);
      surfaces[{0, k}] = moved(world, camera_from_world);
    }
  }
};

TEST(LocalMaps, AreCutByWayAndFindEachOtherAgain) {
  const Walk walk;
  LocalMapOptions options;
  options.distance_m = 0.7;
  const core::Executor one(1);
  const core::Executor two(2);
  const std::vector<LocalMap> local_maps = make_local_maps(walk.map, walk.surfaces, options, two);
  std::size_t members = 0;
  for (const LocalMap& local : local_maps) {
    members += local.members.size();
    EXPECT_LE(local.members.size(), 6U);
    EXPECT_FALSE(local.surface.empty());
  }
  EXPECT_EQ(members, 20U);
  EXPECT_GT(local_maps.size(), 4U);
  const auto pairs = overlapping_pairs(walk.map, local_maps, {}, two);
  const bool revisit = std::any_of(pairs.begin(), pairs.end(), [&](const LocalMapPair& p) {
    return p.a == 0 && p.b == local_maps.size() - 1;
  });
  EXPECT_TRUE(revisit);
  const auto first = align_pairs(walk.map, local_maps, pairs, {}, one);
  const auto second = align_pairs(walk.map, local_maps, pairs, {}, two);
  const auto edges = to_edges(local_maps, pairs, first);
  ASSERT_FALSE(edges.empty());
  for (std::size_t i = 0; i < first.size(); ++i) {
    EXPECT_EQ(std::memcmp(&first[i].b_from_a, &second[i].b_from_a, sizeof(Rigid3)), 0);
    EXPECT_EQ(first[i].refused, second[i].refused);
  }
  for (const PoseEdge& edge : edges) {
    const Rigid3 truth = walk.map.camera_from_world(edge.b) * walk.map.camera_from_world(edge.a).inverse();
    EXPECT_LT(tests::distance(edge.b_from_a, truth), 0.002);
  }
}

TEST(LocalMaps, OfNothingAreNone) {
  const maps::Map empty;
  const core::Executor executor(1);
  EXPECT_TRUE(make_local_maps(empty, {}, {}, executor).empty());
  EXPECT_TRUE(overlapping_pairs(empty, {}, {}, executor).empty());
}

}  // namespace
}  // namespace plumbline::mapping
