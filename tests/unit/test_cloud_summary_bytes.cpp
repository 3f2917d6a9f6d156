// SPDX-License-Identifier: BSD-3-Clause
// Summaries of views as bytes.
#include <gtest/gtest.h>

#include <limits>

#include "plumbline/cloud/compact_cloud.hpp"
#include "plumbline/cloud/keyframe_cloud.hpp"
#include "plumbline/cloud/sensor_pose.hpp"
#include "plumbline/cloud/summary_bytes.hpp"
#include "plumbline/cloud/view_points.hpp"
#include "test_cloud_worlds.hpp"

namespace plumbline::cloud {
namespace {

/// Of a slanted, noisy plane with a hole, seen by a depth camera that lies beside the camera.
KeptSummary kept() {
  sensor::RgbdFrame frame =
      worlds::frame_of(worlds::plane_depth(Eigen::Vector3d(0.3, 0.1, 0.9).normalized(), 2.0, 1.0));
  frame.depth(cv::Rect(100, 100, 57, 31)) = 0.0F;
  const CloudPtr cloud = organised_cloud(frame, worlds::camera());
  const Eigen::Quaterniond turned(Eigen::AngleAxisd(0.02, Eigen::Vector3d::UnitY()));
  set_sensor_pose(*cloud, geometry::Rigid3(turned, Eigen::Vector3d(0.025, 0.001, -0.002)));
  ViewPoints points;
  take_points(*cloud, points);
  return {summarise_view(points, worlds::camera(), {}), points.camera_from_depth};
}

core::Result<KeptSummary> read(const std::vector<std::uint8_t>& bytes) {
  return decode_summary(bytes.data(), bytes.size(), worlds::camera());
}

void expect_same(const KeptSummary& a, const KeptSummary& b) {
  EXPECT_EQ(a.camera_from_depth.rotation, b.camera_from_depth.rotation);
  EXPECT_EQ(a.camera_from_depth.translation, b.camera_from_depth.translation);
  EXPECT_EQ(a.summary.look, b.summary.look);
  EXPECT_EQ(a.summary.raster.nearest, b.summary.raster.nearest);
  EXPECT_EQ(a.summary.raster.width, b.summary.raster.width);
  EXPECT_EQ(a.summary.raster.height, b.summary.raster.height);
  EXPECT_EQ(a.summary.raster.furthest_m, b.summary.raster.furthest_m);
  EXPECT_EQ(a.summary.raster.camera.fx, b.summary.raster.camera.fx);
  ASSERT_EQ(a.summary.spots.size(), b.summary.spots.size());
  for (std::size_t i = 0; i < a.summary.spots.size(); ++i) {
    EXPECT_EQ(a.summary.spots[i].point, b.summary.spots[i].point);
    EXPECT_EQ(a.summary.spots[i].color, b.summary.spots[i].color);
    EXPECT_EQ(a.summary.spots[i].points, b.summary.spots[i].points);
  }
}

TEST(SummaryBytes, ComeBackToTheLastBit) {
  KeptSummary one = kept();
  ASSERT_GT(one.summary.spots.size(), 100U);
  one.summary.raster.nearest[7] = std::numeric_limits<std::uint16_t>::max();  // the longest steps
  one.summary.raster.nearest[8] = 0;
  const std::vector<std::uint8_t> bytes = encode_summary(one);
  const auto back = read(bytes);
  ASSERT_TRUE(back) << back.error().message;
  expect_same(*back, one);
  EXPECT_EQ(encode_summary(*back), bytes);
}

TEST(SummaryBytes, OfALookAndOfAViewOfNothing) {
  KeptSummary look = kept();
  look.summary.look = true;
  look.summary.spots.clear();
  KeptSummary nothing = look;
  nothing.summary.look = false;
  std::fill(nothing.summary.raster.nearest.begin(), nothing.summary.raster.nearest.end(), std::uint16_t{0});
  for (const KeptSummary& one : {look, nothing}) {
    const auto back = read(encode_summary(one));
    ASSERT_TRUE(back) << back.error().message;
    expect_same(*back, one);
  }
}

TEST(SummaryBytes, DamagedOnesAreRefused) {
  const std::vector<std::uint8_t> bytes = encode_summary(kept());
  for (std::size_t cut = 0; cut < bytes.size(); cut += 1 + bytes.size() / 50) {
    EXPECT_FALSE(read({bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(cut)})) << cut;
  }
  for (const std::size_t at : {std::size_t{0}, std::size_t{4}, std::size_t{10}, bytes.size() / 2}) {
    std::vector<std::uint8_t> changed = bytes;
    changed[at] ^= 0x11U;
    const auto back = read(changed);
    ASSERT_FALSE(back) << at;
    EXPECT_EQ(back.error().kind, core::ErrorKind::kInput);
  }
  EXPECT_FALSE(decode_summary(nullptr, 0, worlds::camera()));
}

TEST(SummaryBytes, OfAnotherCameraAreRefused) {
  const std::vector<std::uint8_t> bytes = encode_summary(kept());
  sensor::Pinhole half = worlds::camera();
  half.width /= 2;
  const auto back = decode_summary(bytes.data(), bytes.size(), half);
  ASSERT_FALSE(back);
  EXPECT_NE(back.error().message.find("camera"), std::string::npos);
}

}  // namespace
}  // namespace plumbline::cloud
