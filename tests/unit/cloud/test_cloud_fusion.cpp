// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "plumbline/cloud/compact/compact_cloud.hpp"
#include "plumbline/cloud/fusion/dense_fusion.hpp"
#include "plumbline/cloud/fusion/exposure.hpp"
#include "plumbline/cloud/fusion/free_space.hpp"
#include "plumbline/cloud/fusion/keyframe_cloud.hpp"
#include "plumbline/cloud/sensor_pose.hpp"
#include "plumbline/sensor/depth_noise.hpp"
#include "test_cloud_worlds.hpp"

namespace plumbline::cloud {
namespace {

using worlds::camera;
using worlds::frame_of;
using worlds::plane_depth;
using worlds::point;

/// Views by cameras that look along z, side by side.
struct Views {
  std::vector<geometry::Rigid3> poses;
  std::vector<CloudPtr> clouds;

  /// The middle of the picture only, which is enough and quick.
  void add(const cv::Mat& depth, double x_m, const cv::Scalar& bgr = cv::Scalar(60, 90, 120)) {
    const cv::Rect middle(160, 120, 320, 240);
    cv::Mat cut(depth.size(), CV_32FC1, cv::Scalar(0));
    depth(middle).copyTo(cut(middle));
    add_whole(cut, x_m, bgr);
  }
  void add_whole(const cv::Mat& depth, double x_m, const cv::Scalar& bgr = cv::Scalar(60, 90, 120)) {
    poses.emplace_back(Eigen::Matrix3d(Eigen::Matrix3d::Identity()), Eigen::Vector3d(x_m, 0.0, 0.0));
    clouds.push_back(organised_cloud(frame_of(depth, bgr), camera()));
  }
  [[nodiscard]] core::Result<FusedCloud> fuse(const DenseFusionOptions& options,
                                              FusionReport* report = nullptr, int threads = 1) const {
    const auto read = [this](std::size_t i) -> core::Result<CloudPtr> {
      return std::make_shared<Cloud>(*clouds[i]);
    };
    return fuse_views(with(read), options, core::Executor(threads), report);
  }
  [[nodiscard]] FusionViews with(const ReadView& read) const {
    return {poses, std::vector<sensor::Pinhole>(poses.size(), camera()), {}, read};
  }
};

Views wall_views(double distance_m, int count = 4) {
  Views views;
  for (int v = 0; v < count; ++v) {
    views.add(plane_depth({0, 0, 1}, distance_m, 1.0, static_cast<unsigned>(v + 1)), 0.1 * v);
  }
  return views;
}

DenseFusionOptions fine() {
  DenseFusionOptions options;
  options.voxels.voxel_m = 0.005;
  return options;
}

double rms_to_wall(const Cloud& cloud, double distance_m) {
  double sum = 0.0;
  for (const Point& p : cloud.points) sum += std::pow(static_cast<double>(p.z) - distance_m, 2);
  return std::sqrt(sum / static_cast<double>(cloud.size()));
}

/// Lays a nearer rectangle into a depth picture.
cv::Mat with_box(cv::Mat depth, const cv::Rect& where, float z) {
  depth(where) = z;
  return depth;
}

std::size_t nearer_than(const Cloud& cloud, float z) {
  return static_cast<std::size_t>(
      std::count_if(cloud.begin(), cloud.end(), [z](const Point& p) { return p.z < z; }));
}

TEST(DenseFusion, AWallFarAwayIsThin) {
  const Views views = wall_views(3.0);
  const auto fused = views.fuse(fine());
  ASSERT_TRUE(fused.has_value());
  DenseFusionOptions raw = fine();
  raw.plane_projection = false;
  const auto slab = views.fuse(raw);
  ASSERT_TRUE(slab.has_value());
  EXPECT_GT(fused->cloud->size(), 10000U);
  EXPECT_LT(rms_to_wall(*fused->cloud, 3.0), 0.0015);  // one measurement: 14 mm
  EXPECT_LT(rms_to_wall(*fused->cloud, 3.0), 0.6 * rms_to_wall(*slab->cloud, 3.0));
  EXPECT_LT(fused->cloud->size(), slab->cloud->size());
}

TEST(DenseFusion, TellsHowExactlyPointsAreKnown) {
  Views views = wall_views(2.0);
  const auto read = [&](std::size_t i) -> core::Result<CloudPtr> {
    return std::make_shared<Cloud>(*views.clouds[i]);
  };
  FusionViews known = views.with(read);
  const auto sigmas = [&](double along_m, double across_m) {
    geometry::Matrix6d covariance = geometry::Matrix6d::Zero();
    covariance.diagonal().head<3>() << across_m * across_m, across_m * across_m, along_m * along_m;
    known.covariances.assign(4, covariance);
    const auto fused = fuse_views(known, fine(), core::Executor(1));
    EXPECT_EQ(fused->columns.others.size(), 1U);
    EXPECT_EQ(fused->columns.others.at(0).name, kSigmaColumn);
    EXPECT_EQ(fused->columns.others.at(0).values.size(), fused->cloud->size());
    std::vector<float> values = fused->columns.others.at(0).values;
    for (const float sigma : values) EXPECT_TRUE(std::isfinite(sigma) && sigma > 0.0F);
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                     values.end());
    return static_cast<double>(values[values.size() / 2]);
  };
  // Four views of a wall 2 m away, most of which all of them see.
  const double depth = sigmas(0.0, 0.0);
  EXPECT_LT(depth, 1.05 * sensor::depth_sigma(2.0));
  EXPECT_GT(depth, 0.4 * sensor::depth_sigma(2.0));
  EXPECT_NEAR(sigmas(0.0, 0.1), depth, 0.2 * depth);  // along the wall it does not matter
  EXPECT_NEAR(sigmas(0.02, 0.0), std::hypot(0.02, depth), 1e-3);
  // A camera that is turned a little is off by more farther away.
  geometry::Matrix6d turned = geometry::Matrix6d::Zero();
  turned(4, 4) = 0.01 * 0.01;
  known.covariances.assign(4, turned);
  const auto fused = fuse_views(known, fine(), core::Executor(1));
  const auto sigma_at = [&](double x_m) {
    double sum = 0.0;
    int count = 0;
    for (std::size_t i = 0; i < fused->cloud->size(); ++i) {
      if (std::abs(static_cast<double>((*fused->cloud)[i].x) - x_m) > 0.05) continue;
      sum += static_cast<double>(fused->columns.others[0].values[i]);
      ++count;
    }
    return sum / count;
  };
  EXPECT_GT(sigma_at(0.6), 1.2 * sigma_at(0.15));
  EXPECT_TRUE(views.fuse(fine())->columns.others.empty());
}

TEST(DenseFusion, AStepStaysAStep) {
  Views views;
  for (int v = 0; v < 4; ++v) {
    cv::Mat depth = plane_depth({0, 0, 1}, 1.0, 1.0, static_cast<unsigned>(v + 1));
    for (int row = 0; row < depth.rows; ++row) {
      for (int column = 320; column < depth.cols; ++column) depth.at<float>(row, column) += 0.02F;
    }
    views.add(depth, 0.0);
  }
  const auto fused = views.fuse(fine());
  ASSERT_TRUE(fused.has_value());
  std::size_t between = 0;
  for (const Point& p : fused->cloud->points) between += std::abs(p.z - 1.01F) < 0.006F ? 1U : 0U;
  EXPECT_LT(static_cast<double>(between), 0.02 * static_cast<double>(fused->cloud->size()));
  EXPECT_GT(nearer_than(*fused->cloud, 1.005F), fused->cloud->size() / 3);
}

TEST(DenseFusion, WhatOthersLookThroughGoes) {
  const cv::Rect box(200, 150, 120, 160);
  Views views;
  for (int v = 0; v < 8; ++v) {
    const cv::Mat wall = plane_depth({0, 0, 1}, 2.5, 1.0, static_cast<unsigned>(v + 1));
    views.add(v < 2 ? with_box(wall, box, 1.5F) : wall, 0.0);
  }
  FusionReport report;
  const auto cleaned = views.fuse(fine(), &report);
  ASSERT_TRUE(cleaned.has_value());
  DenseFusionOptions keep = fine();
  keep.free_space = false;
  const auto kept = views.fuse(keep);
  ASSERT_TRUE(kept.has_value());
  EXPECT_GT(nearer_than(*kept->cloud, 2.0F), 1000U);
  EXPECT_LE(nearer_than(*cleaned->cloud, 2.0F), nearer_than(*kept->cloud, 2.0F) / 100);
  EXPECT_GT(report.seen_through, 1000U);
}

/// One view with a box before a wall; then, as the camera would turn away, no more clouds of it, but looks
/// that show the box gone, or still there.
Views a_box_and_looks(int gone, int there) {
  const cv::Rect box(200, 150, 120, 160);
  Views views;
  const auto wall = [](int v) { return plane_depth({0, 0, 1}, 2.5, 1.0, static_cast<unsigned>(v + 1)); };
  views.add(with_box(wall(0), box, 1.5F), 0.0);
  for (int v = 1; v <= gone + there; ++v) {
    views.add(v <= gone ? wall(v) : with_box(wall(v), box, 1.5F), 0.0);
    views.clouds.back() =
        depth_view(frame_of(v <= gone ? wall(v) : with_box(wall(v), box, 1.5F)), camera(), 0.2, 8.0);
  }
  return views;
}

TEST(DenseFusion, LooksTellWhatIsGoneAndAddNoPoints) {
  DenseFusionOptions keep = fine();
  keep.free_space = false;
  const auto kept = a_box_and_looks(2, 0).fuse(keep);
  const auto alone = a_box_and_looks(0, 0).fuse(keep);
  ASSERT_TRUE(kept && alone);
  EXPECT_EQ(kept->cloud->size(), alone->cloud->size());
  const std::size_t box = nearer_than(*kept->cloud, 2.0F);
  EXPECT_GT(box, 1000U);
  EXPECT_LE(nearer_than(*a_box_and_looks(2, 0).fuse(fine())->cloud, 2.0F), box / 100);
  EXPECT_GT(nearer_than(*a_box_and_looks(1, 4).fuse(fine())->cloud, 2.0F), box * 9 / 10);
  EXPECT_GT(nearer_than(*a_box_and_looks(0, 3).fuse(fine())->cloud, 2.0F), box * 9 / 10);
}

TEST(DenseFusion, ALookKeepsTheNearestOfItsCells) {
  cv::Mat depth(480, 640, CV_32FC1, cv::Scalar(2.0F));
  depth.at<float>(101, 202) = 1.0F;        // in cell (50, 25)
  depth(cv::Rect(400, 200, 4, 4)) = 0.0F;  // nothing measured
  depth(cv::Rect(404, 200, 4, 4)) = 9.0F;  // out of range
  const CloudPtr look = depth_view(frame_of(depth), camera(), 0.2, 8.0);
  ASSERT_EQ(look->width, 160U);
  ASSERT_EQ(look->height, 120U);
  EXPECT_TRUE(is_depth_view(*look, camera()));
  EXPECT_FLOAT_EQ(look->at(50, 25).z, 1.0F);
  EXPECT_FLOAT_EQ(look->at(51, 25).z, 2.0F);
  EXPECT_TRUE(std::isnan(look->at(100, 50).z));
  EXPECT_TRUE(std::isnan(look->at(101, 50).z));
  const auto bytes = encode_cloud(*look);
  const auto again = decode_cloud(bytes.data(), bytes.size());
  ASSERT_TRUE(again.has_value());
  EXPECT_TRUE(is_depth_view(**again, camera()));
  EXPECT_EQ(depth_raster(**again, camera()).nearest, depth_raster(*look, camera()).nearest);
  EXPECT_FALSE(is_depth_view(*organised_cloud(frame_of(depth), camera()), camera()));
}

/// Twelve views of a wall, five with a box before it. Of the others, which measure nothing where the right
/// part of the box was, one looks through that part and, if the box is gone, all look through the left one.
Views views_of_a_box(bool gone) {
  const cv::Rect box(200, 150, 70, 160);
  const cv::Rect left(180, 130, 66, 200);
  const cv::Rect right(246, 130, 44, 200);
  Views views;
  for (int v = 0; v < 12; ++v) {
    cv::Mat depth = plane_depth({0, 0, 1}, 2.5, 1.0, static_cast<unsigned>(v + 1));
    if (v < 5) depth = with_box(depth, box, 1.5F);
    if (v >= 5 && !gone) depth(left) = 0.0F;
    if (v > 5) depth(right) = 0.0F;
    views.add(depth, 0.0);
  }
  return views;
}

TEST(DenseFusion, OneViewIsEnoughAmongWhatGoes) {
  DenseFusionOptions keep = fine();
  keep.free_space = false;
  const Views views = views_of_a_box(true);
  const auto kept = views.fuse(keep);
  const auto cleaned = views.fuse(fine());
  ASSERT_TRUE(kept && cleaned);
  EXPECT_GT(nearer_than(*kept->cloud, 1.7F), 1000U);
  EXPECT_LE(nearer_than(*cleaned->cloud, 1.7F), nearer_than(*kept->cloud, 1.7F) / 100);
}

TEST(DenseFusion, OneViewAgainstManyIsNotEnough) {
  DenseFusionOptions keep = fine();
  keep.free_space = false;
  const Views views = views_of_a_box(false);
  EXPECT_GT(nearer_than(*views.fuse(fine())->cloud, 1.7F),
            nearer_than(*views.fuse(keep)->cloud, 1.7F) * 9 / 10);
}

TEST(DenseFusion, WhatMostSeeStays) {
  const cv::Rect box(200, 150, 120, 160);
  Views views;
  for (int v = 0; v < 8; ++v) {
    const cv::Mat wall = plane_depth({0, 0, 1}, 2.5, 1.0, static_cast<unsigned>(v + 1));
    views.add(v != 3 ? with_box(wall, box, 1.5F) : wall, 0.0);  // one view errs
  }
  const auto fused = views.fuse(fine());
  ASSERT_TRUE(fused.has_value());
  EXPECT_GT(nearer_than(*fused->cloud, 2.0F), 1000U);
}

TEST(DenseFusion, SameBytesForAnyNumberOfThreadsAndTilesMeet) {
  const Views views = wall_views(2.0);
  DenseFusionOptions options = fine();
  options.tile_mb = 2.0;  // less than the least the option allows: many tiles
  FusionReport report;
  const auto one = views.fuse(options, &report, 1);
  const auto three = views.fuse(options, nullptr, 3);
  const auto whole = views.fuse(fine());
  ASSERT_TRUE(one && three && whole);
  EXPECT_GT(report.tiles, 3U);
  ASSERT_EQ(one->cloud->size(), three->cloud->size());
  for (std::size_t i = 0; i < one->cloud->size(); ++i) {
    const Point& a = (*one->cloud)[i];
    const Point& b = (*three->cloud)[i];
    ASSERT_TRUE(a.getVector3fMap() == b.getVector3fMap() && a.rgba == b.rgba);
  }
  EXPECT_EQ(one->columns.observations, three->columns.observations);
  EXPECT_NEAR(static_cast<double>(one->cloud->size()), static_cast<double>(whole->cloud->size()),
              0.002 * static_cast<double>(whole->cloud->size()));
}

TEST(DenseFusion, NothingAndErrors) {
  EXPECT_EQ(Views().fuse(fine())->cloud->size(), 0U);
  Views blind;
  blind.add(cv::Mat(480, 640, CV_32FC1, cv::Scalar(0)), 0.0);
  EXPECT_EQ(blind.fuse(fine())->cloud->size(), 0U);
  const auto gone = [](std::size_t) -> core::Result<CloudPtr> { return core::output_error("gone"); };
  const auto failed = fuse_views(blind.with(gone), fine(), core::Executor(1));
  ASSERT_FALSE(failed.has_value());
  EXPECT_EQ(failed.error().message, "gone");
}

TEST(DenseFusion, CloudsLieWhereTheirSensorWas) {
  Views views = wall_views(2.0);
  const auto before = views.fuse(fine());
  for (std::size_t v = 0; v < views.poses.size(); ++v) {
    const geometry::Rigid3 camera_from_depth(Eigen::Matrix3d::Identity(), Eigen::Vector3d(0.0, 0.0, 0.25));
    set_sensor_pose(*views.clouds[v], camera_from_depth);
    views.poses[v] = views.poses[v] * camera_from_depth.inverse();
  }
  const auto after = views.fuse(fine());
  ASSERT_TRUE(before && after);
  EXPECT_EQ(after->cloud->size(), before->cloud->size());
  EXPECT_LT(rms_to_wall(*after->cloud, 2.0), 0.002);
}

TEST(DenseFusion, EveryPointKnowsHowWellItIsKnown) {
  const auto fused = wall_views(2.0).fuse(fine());
  ASSERT_TRUE(fused.has_value());
  const std::size_t count = fused->cloud->size();
  ASSERT_EQ(fused->columns.confidence.size(), count);
  ASSERT_EQ(fused->columns.observations.size(), count);
  std::uint32_t most = 0;
  for (std::size_t i = 0; i < count; ++i) {
    EXPECT_GT(fused->columns.confidence[i], 0.0F);
    EXPECT_LT(fused->columns.confidence[i], 1.0F);
    most = std::max(most, fused->columns.observations[i]);
  }
  EXPECT_EQ(most, 4U);
}

TEST(DenseFusion, CoarserLevelsHaveFewerPoints) {
  const auto fused = wall_views(2.0).fuse(fine());
  ASSERT_TRUE(fused.has_value());
  const FusedCloud coarse = coarser(*fused->cloud, fused->columns, 0.02);
  EXPECT_LT(coarse.cloud->size(), fused->cloud->size() / 6);
  EXPECT_GT(coarse.cloud->size(), fused->cloud->size() / 40);
  EXPECT_LT(rms_to_wall(*coarse.cloud, 2.0), 0.002);
}

TEST(Exposure, ViewsAgreeOnColours) {
  Views views;
  views.add(plane_depth({0, 0, 1}, 2.0, 1.0, 1), 0.0, cv::Scalar(100, 100, 100));
  views.add(plane_depth({0, 0, 1}, 2.0, 1.0, 2), 0.1, cv::Scalar(100, 100, 100));
  views.add(plane_depth({0, 0, 1}, 2.0, 1.0, 3), 0.2, cv::Scalar(140, 120, 100));
  std::vector<std::vector<ColorCell>> cells;
  for (std::size_t v = 0; v < 3; ++v) cells.push_back(color_cells(*views.clouds[v], views.poses[v], 0.1));
  const auto gains = color_gains(cells);
  ASSERT_EQ(gains.size(), 3U);
  EXPECT_NEAR(gains[0].z() / gains[2].z(), 1.4F, 0.03F);  // blue
  EXPECT_NEAR(gains[0].y() / gains[2].y(), 1.2F, 0.02F);
  EXPECT_NEAR(gains[0].x() / gains[2].x(), 1.0F, 0.01F);
  EXPECT_NEAR((gains[0].z() * gains[1].z() * gains[2].z()), 1.0F, 0.02F);
}

TEST(Exposure, WithoutAnythingSharedNothingChanges) {
  Views views;
  views.add(plane_depth({0, 0, 1}, 2.0, 1.0, 1), 0.0, cv::Scalar(50, 50, 50));
  views.add(plane_depth({0, 0, 1}, 2.0, 1.0, 2), 50.0, cv::Scalar(200, 200, 200));
  std::vector<std::vector<ColorCell>> cells;
  for (std::size_t v = 0; v < 2; ++v) cells.push_back(color_cells(*views.clouds[v], views.poses[v], 0.1));
  for (const Eigen::Vector3f& gain : color_gains(cells)) EXPECT_EQ(gain, Eigen::Vector3f(1, 1, 1));
  EXPECT_TRUE(color_gains({}).empty());
}

TEST(FreeSpace, EvidenceOfAView) {
  Views views;
  views.add_whole(with_box(plane_depth({0, 0, 1}, 2.0, 0.0), cv::Rect(0, 0, 160, 480), 1.0F), 0.0);
  const DepthRaster raster = depth_raster(*views.clouds[0], camera());
  const DepthLimits limits(raster);
  const auto at = [&](double u, double v, double z) {
    return limits.evidence(camera().unproject(u, v, z).cast<float>());
  };
  EXPECT_EQ(at(400, 240, 1.0), Evidence::kFree);
  EXPECT_EQ(at(400, 240, 2.0), Evidence::kSurface);
  EXPECT_EQ(at(400, 240, 2.03), Evidence::kSurface);  // within noise
  EXPECT_EQ(at(400, 240, 2.4), Evidence::kHidden);
  EXPECT_EQ(at(80, 240, 1.4), Evidence::kHidden);
  EXPECT_EQ(at(80, 240, 2.7), Evidence::kNone);      // beyond all that the view measured
  EXPECT_EQ(at(162, 240, 1.5), Evidence::kSurface);  // at the box's border: not sure
  EXPECT_EQ(at(-50, 240, 1.0), Evidence::kNone);
  EXPECT_EQ(at(400, 240, -1.0), Evidence::kNone);
}

}  // namespace
}  // namespace plumbline::cloud
