// SPDX-License-Identifier: BSD-3-Clause
// Filters of ours as a program of PCL's uses them: indices, negative, removed, organised, other point types.
#include <gtest/gtest.h>
#include <pcl/exceptions.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <limits>
#include <memory>
#include <numeric>

#include "plumbline/cloud/filters/flying_pixels.hpp"
#include "plumbline/cloud/filters/incidence_angle.hpp"
#include "plumbline/cloud/filters/normal_consistency.hpp"

namespace plumbline::cloud {
namespace {

using Points = pcl::PointCloud<pcl::PointNormal>;
constexpr float kHole = std::numeric_limits<float>::quiet_NaN();

pcl::PointNormal facing(float x, float y, float z) { return {x, y, z, 0.0F, 0.0F, -1.0F}; }

/// 8 x 6 pixels of a wall at 2 m, 1 cm apart; the right half 1 m further away, the first pixel a hole.
Points::Ptr step() {
  auto points = std::make_shared<Points>(8, 6);
  for (std::size_t i = 0; i < points->size(); ++i) {
    const auto u = static_cast<float>(i % 8);
    const auto v = static_cast<float>(i / 8);
    (*points)[i] = facing(0.01F * u, 0.01F * v, u < 4.0F ? 2.0F : 3.0F);
  }
  (*points)[0].x = kHole;
  points->is_dense = false;
  return points;
}

pcl::Indices indices_of(pcl::FilterIndices<pcl::PointNormal>& filter) {
  pcl::Indices indices{7, 7, 7};  // of an earlier call
  filter.filter(indices);
  return indices;
}

/// Kept and removed are all there is, in order; negative exchanges them but for the hole.
void expect_pcls_ways(pcl::FilterIndices<pcl::PointNormal>& filter, const Points::ConstPtr& points,
                      std::size_t kept_points) {
  filter.setInputCloud(points);
  const pcl::Indices kept = indices_of(filter);
  pcl::Indices removed = *filter.getRemovedIndices();
  EXPECT_EQ(kept.size(), kept_points);
  EXPECT_EQ(kept.size() + removed.size(), points->size());
  EXPECT_TRUE(std::is_sorted(kept.begin(), kept.end()));
  EXPECT_TRUE(std::is_sorted(removed.begin(), removed.end()));

  Points list;
  filter.filter(list);
  ASSERT_EQ(list.size(), kept.size());
  EXPECT_EQ(list.height, 1U);
  for (std::size_t i = 0; i < kept.size(); ++i) {
    EXPECT_EQ(list[i].getVector3fMap(), (*points)[static_cast<std::size_t>(kept[i])].getVector3fMap());
  }

  filter.setKeepOrganized(true);
  Points picture;
  filter.filter(picture);
  EXPECT_EQ(picture.width, points->width);
  EXPECT_EQ(picture.height, points->height);
  EXPECT_FALSE(picture.is_dense);
  for (const int i : kept) EXPECT_TRUE(pcl::isFinite(picture[static_cast<std::size_t>(i)]));
  for (const int i : removed) EXPECT_FALSE(pcl::isFinite(picture[static_cast<std::size_t>(i)]));
  filter.setKeepOrganized(false);

  filter.setNegative(true);
  removed.erase(removed.begin());  // the hole is removed either way
  EXPECT_EQ(indices_of(filter), removed);
  filter.setNegative(false);

  const auto some = std::make_shared<pcl::Indices>(pcl::Indices{0, removed.front(), kept.back()});
  filter.setIndices(some);
  EXPECT_EQ(indices_of(filter), pcl::Indices{kept.back()});

  filter.setInputCloud(std::make_shared<Points>());
  filter.setIndices(std::make_shared<pcl::Indices>());
  EXPECT_TRUE(indices_of(filter).empty());
}

TEST(PclFilters, FlyingPixels) {
  FlyingPixels<pcl::PointNormal> filter(true);
  // Both columns at the jump go; of the corner beside the hole 2 of 3 neighbours are left, and two corners of
  // the right half have 3.
  filter.setMinNeighbours(1);
  expect_pcls_ways(filter, step(), 35);
}

TEST(PclFilters, FlyingPixelsOfOtherPointsAndOfAList) {
  auto points = std::make_shared<pcl::PointCloud<pcl::PointXYZ>>(5, 5, pcl::PointXYZ(kHole, kHole, kHole));
  (*points)(2, 2) = pcl::PointXYZ(0, 0, 1);
  FlyingPixels<pcl::PointXYZ> filter;
  filter.setInputCloud(points);
  pcl::Indices kept;
  filter.filter(kept);
  EXPECT_TRUE(kept.empty()) << "a speck";
  filter.setMinNeighbours(0);
  filter.filter(kept);
  EXPECT_EQ(kept, pcl::Indices{12});
  points->width = 25;
  points->height = 1;
  EXPECT_THROW(filter.filter(kept), pcl::UnorganizedPointCloudException);
}

TEST(PclFilters, FlyingPixelsAlongTheRayFromTheViewpoint) {
  FlyingPixels<pcl::PointNormal> filter;
  filter.setInputCloud(step());
  filter.setMinNeighbours(1);
  // Seen from the side both halves are lines along the ray: no measurement noise explains that.
  filter.setViewpoint({100.0F, 0.0F, 2.5F});
  EXPECT_EQ(indices_of(filter).size(), 47U) << "at 100 m the noise is 19 m";
  filter.setViewpoint({-1.0F, 0.0F, 2.0F});
  filter.setMaxAngle(0.5);
  EXPECT_LT(indices_of(filter).size(), 47U);
  auto moved = step();
  moved->sensor_origin_ = Eigen::Vector4f(0.0F, 0.0F, -100.0F, 0.0F);
  FlyingPixels<pcl::PointNormal> by_origin;
  by_origin.setInputCloud(moved);
  by_origin.setMinNeighbours(1);
  EXPECT_EQ(indices_of(by_origin).size(), 47U);
}

TEST(PclFilters, IncidenceAngle) {
  auto points = step();
  for (std::size_t i = 0; i < 8; ++i) (*points)[i].getNormalVector3fMap() = Eigen::Vector3f::UnitX();
  (*points)[47].getNormalVector3fMap().setConstant(kHole);
  IncidenceAngle<pcl::PointNormal> filter(true);
  expect_pcls_ways(filter, points, 39);
  filter.setInputCloud(points);
  const auto all = std::make_shared<pcl::Indices>(points->size());
  std::iota(all->begin(), all->end(), 0);
  filter.setIndices(all);
  filter.setKeepUnknown(true);
  EXPECT_EQ(indices_of(filter).size(), 40U);
  filter.setViewpoint({10.0F, 0.03F, 2.0F});  // the first row faces it, the others do not
  EXPECT_EQ(indices_of(filter).size(), 8U);
}

TEST(PclFilters, NormalConsistency) {
  auto points = step();
  (*points)[20].getNormalVector3fMap() = Eigen::Vector3f::UnitX();
  (*points)[21].getNormalVector3fMap().setConstant(kHole);
  NormalConsistency<pcl::PointNormal> filter(true);
  filter.setNeighbours(8);
  expect_pcls_ways(filter, points, 45);
}

TEST(PclFilters, NormalConsistencyOnThreadsAndOfFewPoints) {
  auto points = std::make_shared<Points>();
  for (int i = 0; i < 3000; ++i) {
    points->push_back(facing(0.01F * static_cast<float>(i % 60), 0.01F * static_cast<float>(i / 60), 1.0F));
    if (i % 7 == 0) points->back().getNormalVector3fMap() = Eigen::Vector3f::UnitY();
  }
  NormalConsistency<pcl::PointNormal> filter;
  filter.setInputCloud(points);
  const pcl::Indices alone = indices_of(filter);
  EXPECT_EQ(alone.size(), 2571U);
  const core::Executor three(3);
  filter.setExecutor(&three);
  EXPECT_EQ(indices_of(filter), alone);

  const auto one = std::make_shared<Points>();
  one->push_back(facing(0.0F, 0.0F, 1.0F));
  NormalConsistency<pcl::PointNormal> of_one;
  of_one.setInputCloud(one);
  EXPECT_TRUE(indices_of(of_one).empty()) << "nothing agrees with it";
  one->push_back(one->front());
  EXPECT_EQ(indices_of(of_one).size(), 2U);
}

}  // namespace
}  // namespace plumbline::cloud
