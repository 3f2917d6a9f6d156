// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <random>

#include "plumbline/cloud/compact/compact_cloud.hpp"
#include "plumbline/cloud/fusion/keyframe_cloud.hpp"
#include "plumbline/cloud/sensor_pose.hpp"
#include "test_cloud_worlds.hpp"

namespace plumbline::cloud {
namespace {

using worlds::point;

bool finite(const Point& p) { return std::isfinite(p.x + p.y + p.z); }

/// A slanted, noisy plane with colours that change, as a camera's organised cloud.
CloudPtr grid_cloud() {
  sensor::RgbdFrame frame =
      worlds::frame_of(worlds::plane_depth(Eigen::Vector3d(0.3, 0.1, 0.9).normalized(), 2.0, 1.0));
  for (int v = 0; v < frame.color.rows; ++v) {
    for (int u = 0; u < frame.color.cols; ++u) {
      frame.color.at<cv::Vec3b>(v, u) = cv::Vec3b(static_cast<std::uint8_t>(u), static_cast<std::uint8_t>(v),
                                                  static_cast<std::uint8_t>(u * v));
    }
  }
  frame.depth(cv::Rect(100, 100, 57, 31)) = 0.0F;
  return organised_cloud(frame, worlds::camera());
}

Cloud list_cloud(std::size_t points) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> coordinate(-30.0F, 30.0F);
  std::normal_distribution<float> direction;
  Cloud cloud;
  for (std::size_t i = 0; i < points; ++i) {
    Point p = point(coordinate(random), coordinate(random), coordinate(random),
                    Eigen::Vector3f(direction(random), direction(random), direction(random)).normalized());
    p.r = static_cast<std::uint8_t>(random());
    p.b = static_cast<std::uint8_t>(random());
    cloud.push_back(p);
  }
  return cloud;
}

CloudPtr there_and_back(const Cloud& cloud) {
  const auto bytes = encode_cloud(cloud);
  const auto decoded = decode_cloud(bytes.data(), bytes.size());
  EXPECT_TRUE(decoded.has_value()) << decoded.error().message;
  return decoded ? *decoded : std::make_shared<Cloud>();
}

void expect_same(const Point& a, const Point& b, float tolerance) {
  EXPECT_LE((a.getVector3fMap() - b.getVector3fMap()).cwiseAbs().maxCoeff(), tolerance);
  EXPECT_EQ(a.r, b.r);
  EXPECT_EQ(a.g, b.g);
  EXPECT_EQ(a.b, b.b);
  EXPECT_EQ(std::isnan(a.normal_x), std::isnan(b.normal_x));
  if (std::isnan(a.normal_x)) return;
  EXPECT_GT(a.getNormalVector3fMap().dot(b.getNormalVector3fMap()), 0.9998F);
}

TEST(CompactCloud, KeepsThePoseOfTheSensor) {
  const CloudPtr grid = grid_cloud();
  const std::size_t without = encode_cloud(*grid).size();
  const geometry::Rigid3 pose(geometry::exp_so3({0.01, -0.02, 0.005}), {0.001, 0.002, -0.003});
  set_sensor_pose(*grid, pose);
  EXPECT_GT(encode_cloud(*grid).size(), without);
  Cloud list = list_cloud(50);
  set_sensor_pose(list, pose);
  for (const CloudPtr& back : {there_and_back(*grid), there_and_back(list)}) {
    EXPECT_LT((sensor_pose(*back).rotation - pose.rotation).norm(), 1e-6);
    EXPECT_LT((sensor_pose(*back).translation - pose.translation).norm(), 1e-8);
  }
  EXPECT_TRUE(sensor_pose(*there_and_back(list_cloud(50))).rotation.isIdentity(0.0));
}

TEST(CompactCloud, KeepsAGridOnItsRays) {
  const CloudPtr cloud = grid_cloud();
  const CloudPtr back = there_and_back(*cloud);
  ASSERT_EQ(back->width, cloud->width);
  ASSERT_EQ(back->height, cloud->height);
  for (std::size_t i = 0; i < cloud->size(); ++i) {
    const Point& a = (*cloud)[i];
    const Point& b = (*back)[i];
    ASSERT_EQ(finite(a), finite(b));
    if (!finite(a)) continue;
    expect_same(a, b, 0.00014F);
    EXPECT_NEAR(b.x / b.z, a.x / a.z, 1e-5F);
  }
}

TEST(CompactCloud, IsSmall) {
  const CloudPtr cloud = grid_cloud();
  EXPECT_LT(encode_cloud(*cloud).size(),
            cloud->size() * 8);  // of 48; this one's colours are harder than most
}

TEST(CompactCloud, KeepsAListInItsOrder) {
  const Cloud cloud = list_cloud(5000);
  const CloudPtr back = there_and_back(cloud);
  ASSERT_EQ(back->size(), cloud.size());
  EXPECT_EQ(back->height, 1U);
  for (std::size_t i = 0; i < cloud.size(); ++i) expect_same(cloud[i], (*back)[i], 0.000128F);
}

TEST(CompactCloud, AGridThatIsNoCameraBecomesAList) {
  CloudPtr cloud = grid_cloud();
  (*cloud)[1000].x += 0.01F;  // off its ray
  const CloudPtr back = there_and_back(*cloud);
  EXPECT_EQ(back->height, 1U);
  std::size_t points = 0;
  for (const Point& p : cloud->points) points += finite(p) ? 1U : 0U;
  EXPECT_EQ(back->size(), points);
}

TEST(CompactCloud, LeavesOutWhatIsNotFiniteAndKeepsUnknownNormals) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  Cloud cloud;
  cloud.push_back(point(1, 2, 3, {nan, nan, nan}));
  cloud.push_back(point(nan, 2, 3));
  cloud.push_back(point(1, std::numeric_limits<float>::infinity(), 3));
  cloud.push_back(point(1e9F, 2, 3));  // further than 2^30 steps
  cloud.push_back(point(-1, -2, -3, {0, 0, 0}));
  const CloudPtr back = there_and_back(cloud);
  ASSERT_EQ(back->size(), 2U);
  EXPECT_TRUE(std::isnan((*back)[0].normal_x));
  EXPECT_TRUE(std::isnan((*back)[1].normal_x));
  EXPECT_NEAR((*back)[1].z, -3.0F, 0.0002F);
  EXPECT_EQ(there_and_back(Cloud())->size(), 0U);
}

TEST(CompactCloud, SameCloudSameBytes) {
  const CloudPtr cloud = grid_cloud();
  EXPECT_EQ(encode_cloud(*cloud), encode_cloud(*cloud));
}

TEST(CompactCloud, DirectionsCoverTheSphere) {
  const Cloud cloud = list_cloud(20000);
  const CloudPtr back = there_and_back(cloud);
  float worst = 1.0F;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    worst = std::min(worst, cloud[i].getNormalVector3fMap().dot((*back)[i].getNormalVector3fMap()));
  }
  EXPECT_GT(worst, std::cos(1.0F * static_cast<float>(M_PI) / 180.0F));
}

std::vector<std::uint8_t> again(const std::vector<std::uint8_t>& bytes) {
  return encode_cloud(**decode_cloud(bytes.data(), bytes.size()));
}

TEST(CompactCloud, DamagedBytesAreAnError) {
  const auto bytes = encode_cloud(list_cloud(300));
  const auto grid = encode_cloud(*grid_cloud());
  std::mt19937 random(5);
  for (std::size_t length = 0; length < bytes.size(); length += 7) {
    EXPECT_FALSE(decode_cloud(bytes.data(), length).has_value()) << length;
  }
  int rejected = 0;
  for (int trial = 0; trial < 200; ++trial) {
    for (const int bytes_of : {0, 1}) {
      auto damaged = bytes_of == 0 ? bytes : grid;
      const std::size_t place = random() % damaged.size();
      damaged[place] ^= static_cast<std::uint8_t>(1U << (random() % 8));
      const auto decoded = decode_cloud(damaged.data(), damaged.size());
      // A few bits of zstd's format say nothing about the content, which its checksum guards.
      rejected += decoded ? 0 : 1;
      if (!decoded) continue;
      EXPECT_EQ(encode_cloud(**decoded), again(bytes_of == 0 ? bytes : grid)) << place;
    }
  }
  EXPECT_GT(rejected, 390);
  auto later = bytes;
  later[4] = 2;
  const auto unknown = decode_cloud(later.data(), later.size());
  ASSERT_FALSE(unknown.has_value());
  EXPECT_EQ(unknown.error().kind, core::ErrorKind::kInput);
  EXPECT_NE(unknown.error().message.find("version"), std::string::npos);
}

}  // namespace
}  // namespace plumbline::cloud
