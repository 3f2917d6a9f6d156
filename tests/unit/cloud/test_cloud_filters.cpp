// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <pcl/filters/voxel_grid.h>

#include <cstring>
#include <set>

#include "plumbline/cloud/fusion/keyframe_cloud.hpp"
#include "plumbline/cloud/io/cloud_io.hpp"
#include "test_cloud_filter_run.hpp"

namespace plumbline::cloud {
namespace {

using worlds::finite_points;
using worlds::point;

using worlds::kNan;
using worlds::list;
using worlds::must;
using worlds::run;
using worlds::square;

TEST(Filters, ChoosingFiltersKeepAnOrganisedCloudOrganised) {
  auto cloud = std::make_shared<Cloud>(3, 2, point(0, 0, 1));
  (*cloud)(1, 0).z = 9.0F;
  (*cloud)(2, 1).x = kNan;
  for (const std::string entry :
       {"{type: crop_box, min: [-1, -1, 0], max: [1, 1, 2]}", "{type: pass_through, field: z, max: 2}"}) {
    const auto output = must(entry, cloud);
    EXPECT_EQ(output->width, 3U) << entry;
    EXPECT_EQ(output->height, 2U) << entry;
    EXPECT_EQ(finite_points(*output), 4U) << entry;
    EXPECT_TRUE(std::isnan((*output)(1, 0).z)) << entry;
    EXPECT_FALSE(output->is_dense) << entry;
  }
  EXPECT_EQ((*cloud)(1, 0).z, 9.0F) << "the input is never changed";
}

TEST(Filters, CropBoxAndPassThroughOutside) {
  const auto cloud = list({point(0, 0, 0), point(2, 0, 0), point(0, -3, 0)});
  EXPECT_EQ(must("{type: crop_box}", cloud)->size(), 1U);
  EXPECT_EQ(must("{type: crop_box, inside: off}", cloud)->size(), 2U);
  EXPECT_EQ(must("{type: pass_through, field: x, min: 1, max: 3}", cloud)->size(), 1U);
  EXPECT_EQ(must("{type: pass_through, field: x, min: 1, max: 3, inside: off}", cloud)->size(), 2U);
  EXPECT_EQ(must("{type: pass_through, field: normal_z, max: 0}", cloud)->size(), 3U);
}

/// A box in front of a wall, with the pixels between them hanging in the air.
cv::Mat step_edge() {
  cv::Mat depth(480, 640, CV_32FC1, cv::Scalar(3.0));
  depth(cv::Rect(200, 150, 200, 200)) = 1.5F;
  depth(cv::Rect(198, 150, 2, 200)) = 2.1F;
  depth(cv::Rect(400, 150, 2, 200)) = 2.6F;
  return depth;
}

TEST(Filters, FlyingPixelsGoAndSurfacesStay) {
  for (int stride : {1, 2}) {
    KeyframeCloudOptions options;
    options.stride_px = stride;
    const auto cloud = organised_cloud(worlds::frame_of(step_edge()), worlds::camera(), options);
    const auto output = must("{type: flying_pixels}", cloud);
    std::size_t hanging = 0;
    for (const Point& p : output->points) hanging += p.z > 1.6F && p.z < 2.9F ? 1U : 0U;
    EXPECT_EQ(hanging, 0U);
    const double kept =
        static_cast<double>(finite_points(*output)) / static_cast<double>(finite_points(*cloud));
    EXPECT_GT(kept, 0.97);
    const auto at = [&](int u, int v) { return (*output)(u / stride, v / stride).z; };
    EXPECT_EQ(at(208, 250), 1.5F);
    EXPECT_EQ(at(190, 250), 3.0F);
  }
}

TEST(Filters, FlyingPixelsLeavesANoisyObliquePlaneAlone) {
  const Eigen::Vector3d normal = Eigen::Vector3d(0.0, 0.9397, 0.342);  // 70 degrees, like a floor
  const auto cloud =
      organised_cloud(worlds::frame_of(worlds::plane_depth(normal, 0.342 * 1.5, 1.0)), worlds::camera());
  const auto near = must("{type: pass_through, max: 3}", cloud);
  const auto output = must("{type: flying_pixels}", near);
  EXPECT_GT(static_cast<double>(finite_points(*output)), 0.98 * static_cast<double>(finite_points(*near)));
}

TEST(Filters, FlyingPixelsNeedsAnOrganisedCloudAndRemovesSpecks) {
  const auto result = run("{type: flying_pixels}", square(4, 0.1F));
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().kind, core::ErrorKind::kUsage);
  EXPECT_NE(result.error().message.find("chain test: filters[0] (flying_pixels): needs an organised cloud"),
            std::string::npos)
      << result.error().message;
  auto speck = std::make_shared<Cloud>(5, 5, point(kNan, kNan, kNan));
  (*speck)(2, 2) = point(0, 0, 1);
  EXPECT_EQ(finite_points(*must("{type: flying_pixels}", speck)), 0U);
  EXPECT_EQ(finite_points(*must("{type: flying_pixels, min_neighbours: 0}", speck)), 1U);
}

TEST(Filters, IncidenceAngle) {
  const Eigen::Vector3f oblique(std::sin(1.4F), 0, -std::cos(1.4F));
  const auto cloud = list({point(0, 0, 2), point(0, 0, 2, oblique), point(0, 0, 2, {kNan, kNan, kNan}),
                           point(0, 0, 2, {0, 0, 1})});
  EXPECT_EQ(must("{type: incidence_angle, max: 70 deg}", cloud)->size(), 2U);
  EXPECT_EQ(must("{type: incidence_angle, max: 70 deg, keep_unknown: on}", cloud)->size(), 3U);
  EXPECT_EQ(must("{type: incidence_angle, max: 85 deg}", cloud)->size(), 3U);
}

TEST(Filters, VoxelGridIsPclsPointForPoint) {
  const auto cloud = square(40, 0.007F);
  const auto output = must("{type: voxel_grid, leaf: 2 cm}", cloud);
  pcl::VoxelGrid<Point> grid;
  grid.setLeafSize(0.02F, 0.02F, 0.02F);
  grid.setInputCloud(cloud);
  Cloud expected;
  grid.filter(expected);
  ASSERT_EQ(output->size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_EQ((*output)[i].getVector3fMap(), expected[i].getVector3fMap());
    EXPECT_NEAR((*output)[i].normal_z, -1.0F, 1e-5F);
    EXPECT_EQ((*output)[i].r, 100);
  }
}

TEST(Filters, UnknownNormalsDoNotSpoilTheMeanOfACell) {
  const auto cloud =
      list({point(0, 0, 0), point(0.001F, 0, 0, {kNan, kNan, kNan}), point(1, 0, 0, {kNan, kNan, kNan})});
  for (const std::string entry :
       {"{type: voxel_grid, leaf: 1 cm}", "{type: approximate_voxel_grid, leaf: 1 cm}"}) {
    const auto output = must(entry, cloud);
    ASSERT_EQ(output->size(), 2U) << entry;
    for (const Point& p : output->points) {
      if (p.x > 0.5F) {
        EXPECT_TRUE(std::isnan(p.normal_z)) << entry;
      }
      if (p.x < 0.5F) {
        EXPECT_NEAR(p.normal_z, -1.0F, 1e-5F) << entry;
      }
    }
  }
}

TEST(Filters, AGridWithTooManyCellsIsAnErrorThatNamesALeafThatFits) {
  const auto cloud = list({point(0, 0, 0), point(100, 100, 100)});
  for (const std::string type : {"voxel_grid", "approximate_voxel_grid", "uniform_sampling"}) {
    const auto result = run("{type: " + type + ", leaf: 1 mm}", cloud);
    ASSERT_FALSE(result) << type;
    EXPECT_NE(result.error().message.find("use a leaf of 0.08"), std::string::npos) << result.error().message;
    EXPECT_TRUE(run("{type: " + type + ", leaf: 85 mm}", cloud)) << type;
  }
  EXPECT_FALSE(run("{type: voxel_grid, leaf: 0.1 mm}", list({point(1e8F, 0, 0)})));
}

TEST(Filters, SamplingChoosesPointsOfTheInput) {
  const auto cloud = square(30, 0.01F);
  const auto uniform = must("{type: uniform_sampling, leaf: 5 cm}", cloud);
  EXPECT_EQ(uniform->size(), 36U);
  const auto random = must("{type: random_sampling, count: 100, seed: 5}", cloud);
  const auto again = must("{type: random_sampling, count: 100, seed: 5}", cloud);
  const auto other = must("{type: random_sampling, count: 100, seed: 6}", cloud);
  ASSERT_EQ(random->size(), 100U);
  std::set<std::pair<float, float>> known;
  for (const Point& p : cloud->points) known.insert({p.x, p.y});
  bool differs = false;
  for (std::size_t i = 0; i < 100; ++i) {
    EXPECT_EQ((*random)[i].getVector3fMap(), (*again)[i].getVector3fMap());
    EXPECT_EQ(known.count({(*random)[i].x, (*random)[i].y}), 1U);
    differs = differs || (*random)[i].getVector3fMap() != (*other)[i].getVector3fMap();
  }
  EXPECT_TRUE(differs);
  EXPECT_EQ(must("{type: random_sampling, count: 1000}", cloud)->size(), 900U);
}

TEST(Filters, OutliersGoWithNanPointsAndOrganisedClouds) {
  auto cloud = std::make_shared<Cloud>(30, 31, point(kNan, kNan, kNan));
  const auto plane = square(30, 0.01F);
  std::copy(plane->begin(), plane->end(), cloud->begin());
  (*cloud)(0, 30) = point(0.15F, 0.15F, 2.0F);
  cloud->is_dense = false;
  for (const std::string entry : {"{type: statistical_outlier, neighbours: 8, deviations: 3}",
                                  "{type: radius_outlier, radius: 2 cm, min_neighbours: 3}"}) {
    const auto output = must(entry, cloud);
    EXPECT_EQ(output->size(), 900U) << entry;
    EXPECT_EQ(output->height, 1U) << entry;
    for (const Point& p : output->points) EXPECT_EQ(p.z, 1.0F) << entry;
  }
}

TEST(Filters, AnyNumberOfThreadsGivesTheSameBytes) {
  const auto cloud = worlds::gauss_ball(40000);
  const core::Executor three(3);
  FilterContext threads;
  threads.executor = &three;
  for (const std::string entry : {"{type: statistical_outlier}", "{type: radius_outlier, radius: 10 cm}",
                                  "{type: normals}", "{type: normal_consistency, neighbours: 8}"}) {
    const auto alone = must(entry, cloud);
    const auto together = must(entry, cloud, threads);
    ASSERT_EQ(alone->size(), together->size()) << entry;
    EXPECT_EQ(std::memcmp(alone->points.data(), together->points.data(), alone->size() * sizeof(Point)), 0)
        << entry;
    EXPECT_GT(alone->size(), 1000U) << entry;
  }
}

TEST(Filters, NormalsPointToTheViewpoint) {
  const auto plane = square(20, 0.01F);
  for (Point& p : plane->points) p.normal_x = p.normal_y = p.normal_z = kNan;
  FilterContext behind;
  behind.viewpoint = Eigen::Vector3f(0, 0, 3);
  const auto expect_normal_z = [](const CloudPtr& cloud, float z) {
    ASSERT_EQ(cloud->size(), 400U);
    for (const Point& p : cloud->points) EXPECT_NEAR(p.normal_z, z, 1e-3F);
  };
  expect_normal_z(must("{type: normals}", plane), -1.0F);
  expect_normal_z(must("{type: normals, neighbours: 0, radius: 25 mm}", plane, behind), 1.0F);
  plane->sensor_origin_ = Eigen::Vector4f(0, 0, 3, 0);
  expect_normal_z(must("{type: normals}", plane), 1.0F);
}

/// Root mean square of z - z_of(x, y).
template <typename Surface>
double roughness(const Cloud& cloud, const Surface& z_of) {
  double sum = 0.0;
  for (const Point& p : cloud.points) sum += std::pow(static_cast<double>(p.z - z_of(p.x, p.y)), 2.0);
  return std::sqrt(sum / static_cast<double>(cloud.size()));
}

TEST(Filters, MlsSmoothsAPlaneAndABowl) {
  std::mt19937 random(3);
  std::normal_distribution<float> noise(0.0F, 0.003F);
  const auto plane = [](float, float) { return 1.0F; };
  const auto bowl = [](float x, float y) { return 1.0F + 2.0F * (x * x + y * y); };
  auto flat = square(40, 0.005F);
  auto round = square(40, 0.005F);
  for (Point& p : flat->points) p.z = plane(p.x, p.y) + noise(random);
  for (Point& p : round->points) p.z = bowl(p.x, p.y) + noise(random);
  const auto smooth = must("{type: mls, radius: 3 cm, order: 0}", flat);
  ASSERT_EQ(smooth->size(), 1600U);
  EXPECT_LT(roughness(*smooth, plane), 0.25 * roughness(*flat, plane));
  for (const Point& p : smooth->points) EXPECT_LT(p.normal_z, -0.98F);
  EXPECT_EQ((*smooth)[0].r, 100) << "colours stay";
  const double curved = roughness(*must("{type: mls, radius: 3 cm, order: 2}", round), bowl);
  EXPECT_LT(curved, 0.4 * roughness(*round, bowl));
  // A plane cannot follow the bowl.
  EXPECT_GT(roughness(*must("{type: mls, radius: 6 cm, order: 0}", round), bowl),
            1.5 * roughness(*must("{type: mls, radius: 6 cm, order: 2}", round), bowl));
}

TEST(Filters, MlsKeepsTheSideOfNormalsAndLosesLonelyPoints) {
  auto cloud = square(10, 0.01F);
  for (Point& p : cloud->points) p.normal_z = 1.0F;
  cloud->push_back(point(5, 5, 5));
  const auto kept = must("{type: mls, radius: 3 cm}", cloud);
  ASSERT_EQ(kept->size(), 100U);
  for (const Point& p : kept->points) EXPECT_NEAR(p.normal_z, 1.0F, 1e-4F);
  for (Point& p : cloud->points) p.normal_z = kNan;
  const auto turned = must("{type: mls, radius: 3 cm}", cloud);
  ASSERT_EQ(turned->size(), 100U);
  for (const Point& p : turned->points) EXPECT_NEAR(p.normal_z, -1.0F, 1e-4F) << "to the viewpoint";
}

TEST(Filters, TransformMovesPointsNormalsAndViewpoint) {
  const auto output = must("{type: transform, rotation: [90 deg, 0 deg, 0 deg], translation: [0, 0, 1 m]}",
                           list({point(1, 2, 3), point(kNan, 0, 0)}));
  EXPECT_LT(((*output)[0].getVector3fMap() - Eigen::Vector3f(1, -3, 3)).norm(), 1e-5F);
  EXPECT_LT(((*output)[0].getNormalVector3fMap() - Eigen::Vector3f(0, 1, 0)).norm(), 1e-5F);
  EXPECT_LT((output->sensor_origin_.head<3>() - Eigen::Vector3f(0, 0, 1)).norm(), 1e-6F);
  EXPECT_FALSE(std::isfinite((*output)[1].x));
}

TEST(Filters, EveryFilterBearsEmptySingleDuplicateAndNanClouds) {
  const auto nan = point(kNan, kNan, kNan, {kNan, kNan, kNan});
  std::vector<CloudPtr> clouds = {std::make_shared<Cloud>(),
                                  list({point(1, 2, 3)}),
                                  list({nan}),
                                  list(std::vector<Point>(50, point(1, 2, 3))),
                                  list({point(0, 0, 1), nan, point(0, 0, 1)}),
                                  std::make_shared<Cloud>(4, 4, nan),
                                  std::make_shared<Cloud>(4, 4, point(0, 0, 1))};
  const auto registry = builtin_filters();
  for (const auto& info : registry.filters()) {
    for (const auto& cloud : clouds) {
      const bool refused = info.type == "flying_pixels" && cloud->height == 1 && !cloud->empty();
      const auto result = run(worlds::least_entry(info.type), cloud);
      EXPECT_EQ(static_cast<bool>(result), !refused) << info.type;
      if (!result) continue;
      EXPECT_LE(finite_points(**result), finite_points(*cloud)) << info.type;
      EXPECT_EQ((*result)->size(), std::size_t{(*result)->width} * (*result)->height) << info.type;
    }
  }
}

}  // namespace
}  // namespace plumbline::cloud
