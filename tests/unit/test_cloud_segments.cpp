// SPDX-License-Identifier: BSD-3-Clause
// Planes, clusters, conditions, files in a chain.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "test_cloud_filter_run.hpp"

namespace plumbline::cloud {
namespace {

using worlds::finite_points;
using worlds::kNan;
using worlds::list;
using worlds::must;
using worlds::point;
using worlds::run;
using worlds::square;

/// A floor of 900 points, a wall of 400 that stands on it, and a ball of 200 in the air.
CloudPtr room() {
  auto cloud = square(30, 0.05F);  // z = 1
  for (int i = 0; i < 400; ++i) {
    const auto y = static_cast<float>(i % 20) * 0.05F;
    const auto z = 1.1F + static_cast<float>(i / 20) * 0.05F;
    cloud->push_back(point(0, y, z, {1, 0, 0}));
  }
  std::mt19937 random(5);
  std::normal_distribution<float> gauss(0.0F, 1.0F);
  for (int i = 0; i < 200; ++i) {
    Eigen::Vector3f ray;
    for (int axis = 0; axis < 3; ++axis) ray[axis] = gauss(random);
    ray.normalize();
    const Eigen::Vector3f p = Eigen::Vector3f(0.8F, 0.8F, 1.8F) + 0.2F * ray;
    cloud->push_back(point(p.x(), p.y(), p.z(), ray));
  }
  cloud->push_back(point(kNan, kNan, kNan));
  cloud->is_dense = false;
  return cloud;
}

std::set<std::uint32_t> colors(const Cloud& cloud, std::size_t begin, std::size_t end) {
  std::set<std::uint32_t> found;
  for (std::size_t i = begin; i < end; ++i) found.insert(cloud[i].rgba & 0xFFFFFFU);
  return found;
}

TEST(Segments, PlanesAreKeptRemovedOrLabelledLargestFirst) {
  const auto cloud = room();
  const auto floor = must("{type: plane, distance: 1 cm}", cloud);
  EXPECT_NEAR(static_cast<double>(floor->size()), 900.0, 5.0);
  for (const Point& p : floor->points) EXPECT_NEAR(p.z, 1.0F, 0.0101F);
  const auto ball = must("{type: plane, distance: 1 cm, planes: 2, mode: remove}", cloud);
  EXPECT_NEAR(static_cast<double>(ball->size()), 200.0, 15.0);
  const auto labels = must("{type: plane, distance: 1 cm, planes: 2, mode: label}", cloud);
  ASSERT_EQ(labels->size(), 1500U);
  EXPECT_EQ(colors(*labels, 0, 900).size(), 1U);
  EXPECT_EQ(colors(*labels, 910, 1300).size(), 1U);
  EXPECT_NE(colors(*labels, 0, 900), colors(*labels, 910, 1300));
  // A third plane would be a slice of the ball: too small.
  EXPECT_EQ(must("{type: plane, distance: 1 cm, planes: 9, mode: remove}", cloud)->size(), ball->size());
  EXPECT_EQ(must("{type: plane, min_points: 1000}", cloud)->size(), 0U);
}

TEST(Segments, APlaneKeepsAnOrganisedCloudOrganised) {
  auto cloud = std::make_shared<Cloud>(20, 20, point(kNan, kNan, kNan));
  for (int i = 0; i < 400; i += 2) {
    (*cloud)(i % 20, i / 20) = point(static_cast<float>(i % 20), static_cast<float>(i / 20), i < 100 ? 3 : 1);
  }
  cloud->is_dense = false;
  const auto output = must("{type: plane, distance: 1 cm}", cloud);
  EXPECT_EQ(output->height, 20U);
  EXPECT_EQ(finite_points(*output), 150U);
  EXPECT_TRUE(std::isnan((*output)(0, 0).z));
  EXPECT_EQ((*output)(0, 19).z, 1.0F);
}

TEST(Segments, PointsOnALineAreNoPlane) {
  std::vector<Point> line;
  for (int i = 0; i < 300; ++i) line.push_back(point(static_cast<float>(i), 0, 1));
  EXPECT_EQ(must("{type: plane}", list(line))->size(), 0U);
  EXPECT_EQ(must("{type: plane, mode: remove}", list(line))->size(), 300U);
}

TEST(Segments, ClustersLargestFirst) {
  const auto cloud = room();
  EXPECT_EQ(must("{type: clusters, distance: 8 cm}", cloud)->size(), 900U);
  EXPECT_EQ(must("{type: clusters, distance: 8 cm, count: 2}", cloud)->size(), 1300U);
  EXPECT_EQ(must("{type: clusters, distance: 8 cm, count: 0}", cloud)->size(), 1500U);
  EXPECT_EQ(must("{type: clusters, distance: 8 cm, count: 0, min_points: 300}", cloud)->size(), 1300U);
  EXPECT_EQ(must("{type: clusters, distance: 11 cm}", cloud)->size(), 1300U)
      << "the wall stands on the floor";
  EXPECT_EQ(must("{type: clusters, distance: 8 cm, mode: remove}", cloud)->size(), 600U);
  const auto labels = must("{type: clusters, distance: 8 cm, count: 2, mode: label}", cloud);
  ASSERT_EQ(labels->size(), 1500U);
  EXPECT_EQ(colors(*labels, 0, 900).size(), 1U);
  EXPECT_EQ(colors(*labels, 0, 1300).size(), 2U);
  EXPECT_EQ(colors(*labels, 1300, 1500), std::set<std::uint32_t>{0x808080U}) << "the rest is grey";
}

/// Two squares of 900 points, 1 m apart, and a speck of 40 between them.
CloudPtr two_squares() {
  auto cloud = square(30, 0.01F);
  const auto other = square(30, 0.01F);
  for (Point p : *other) {
    p.x -= 1.3F;  // over the border of blocks
    cloud->push_back(p);
  }
  for (int i = 0; i < 40; ++i) cloud->push_back(point(-0.5F + 0.01F * static_cast<float>(i % 8), 0.2F, 1));
  return cloud;
}

TEST(Segments, ClustersOverTheMeansOfCells) {
  const auto cloud = two_squares();
  const std::string entry = "{type: clusters, distance: 4 cm, leaf: 2 cm, count: 0, min_points: ";
  const auto kept = must(entry + "41}", cloud);
  ASSERT_EQ(kept->size(), 1800U);
  for (std::size_t i = 0; i < kept->size(); ++i) {
    EXPECT_EQ((*kept)[i].getVector3fMap(), (*cloud)[i].getVector3fMap()) << "points stay as they are";
  }
  EXPECT_EQ(must(entry + "40}", cloud)->size(), 1840U);
  EXPECT_EQ(must(entry + "901}", cloud)->size(), 0U);
  EXPECT_EQ(must(entry + "901, min_share: 45 %}", cloud)->size(), 1800U);
  EXPECT_EQ(must(entry + "901, mode: remove}", cloud)->size(), 1840U);
  const auto labels = must("{type: clusters, distance: 4 cm, leaf: 2 cm, count: 1, mode: label}", cloud);
  EXPECT_EQ(colors(*labels, 0, 900).count(0x808080U), 0U) << "of equals the first";
  EXPECT_EQ(colors(*labels, 900, 1840), std::set<std::uint32_t>{0x808080U});
}

TEST(Segments, ClustersOfCellsKnowNoLimitOfPclsGrids) {
  auto cloud = two_squares();
  const auto other = square(30, 0.01F);
  for (Point p : *other) {
    p.getVector3fMap() += Eigen::Vector3f(300, 300, 300);  // 3e15 cells of 2 mm
    cloud->push_back(p);
  }
  const std::string entry = "{type: clusters, distance: 2 cm, leaf: 2 mm, count: 0, min_points: 100}";
  EXPECT_EQ(must(entry, cloud)->size(), 2700U);
  cloud->push_back(point(1e8F, 0, 0));
  const auto result = run(entry, cloud);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().kind, core::ErrorKind::kUsage);
  EXPECT_NE(result.error().message.find("remove them first (crop_box) or use a leaf of 0.1 m or more"),
            std::string::npos)
      << result.error().message;
  EXPECT_TRUE(run("{type: clusters, leaf: 101 mm}", cloud));
}

TEST(Segments, ClustersReachAsFarAsAFusedCloudIsCoarse) {
  const auto coarse = square(30, 0.05F);
  const std::string entry = "{type: clusters, distance: 4 cm, leaf: 2 cm, count: 0, min_points: 200}";
  EXPECT_EQ(must(entry, coarse)->size(), 0U);
  FilterContext context;
  context.spacing_m = 0.05;
  EXPECT_EQ(must(entry, coarse, context)->size(), 900U);
}

TEST(Segments, NormalConsistencyRemovesTheOddOneAndKeepsEdges) {
  auto cloud = square(20, 0.01F);
  for (int i = 0; i < 400; ++i) {
    cloud->push_back(
        point(0, static_cast<float>(i % 20) * 0.01F, 1.01F + static_cast<float>(i / 20) * 0.01F, {1, 0, 0}));
  }
  (*cloud)[210].getNormalVector3fMap() = Eigen::Vector3f(0, 1, 0);
  (*cloud)[110].getNormalVector3fMap().setConstant(kNan);
  const auto output = must("{type: normal_consistency, neighbours: 12}", cloud);
  EXPECT_EQ(output->size(), 798U);
  for (const Point& p : output->points) EXPECT_NE(p.normal_y, 1.0F);
  EXPECT_LT(must("{type: normal_consistency, neighbours: 12, min_share: 90 %}", cloud)->size(), 780U);
}

TEST(Segments, ColourChannels) {
  const auto colored = [](std::uint8_t r, std::uint8_t g, std::uint8_t b) {
    Point p = point(0, 0, 1);
    p.r = r;
    p.g = g;
    p.b = b;
    return p;
  };
  const auto cloud = list({colored(250, 10, 10), colored(10, 250, 10), colored(10, 10, 250),
                           colored(250, 10, 50), colored(90, 90, 90), point(kNan, 0, 0)});
  const auto count = [&](const std::string& options) {
    return must("{type: color, " + options + "}", cloud)->size();
  };
  EXPECT_EQ(count("channel: red, min: 200, max: 255"), 2U);
  EXPECT_EQ(count("channel: green, min: 90, max: 250"), 2U) << "limits belong to it";
  EXPECT_EQ(count("channel: blue, min: 11, max: 250, inside: off"), 2U);
  EXPECT_EQ(count("channel: hue, min: 100, max: 140"), 1U);
  EXPECT_EQ(count("channel: hue, min: 20, max: 340, inside: off"), 3U) << "two reds and grey";
  EXPECT_EQ(count("channel: saturation, min: 0.5, max: 1"), 4U);
  EXPECT_EQ(count("channel: value, min: 0, max: 0.5"), 1U);
  EXPECT_FALSE(run("{type: color, channel: value, min: 2}", cloud));
  EXPECT_FALSE(run("{type: color, min: 5, max: 5}", cloud));
}

TEST(Segments, CurvatureWithinLimits) {
  auto cloud = list({point(0, 0, 1), point(1, 0, 1), point(2, 0, 1)});
  (*cloud)[1].curvature = 0.2F;
  (*cloud)[2].curvature = kNan;
  EXPECT_EQ(must("{type: curvature}", cloud)->size(), 1U);
  const auto bent = must("{type: curvature, min: 0.1, max: 0.3}", cloud);
  ASSERT_EQ(bent->size(), 1U);
  EXPECT_EQ((*bent)[0].x, 1.0F);
}

TEST(Segments, MergeAddsAFileAndSaysBeforehandWhenItIsMissing) {
  const std::string other = worlds::temporary("other.ply");
  ASSERT_TRUE(write_ply(other, *list({point(7, 8, 9), point(kNan, 0, 0)})));
  auto cloud = list({point(1, 2, 3), point(kNan, 0, 0)});
  const auto merged = must("{type: merge, file: " + other + "}", cloud);
  ASSERT_EQ(merged->size(), 2U);
  EXPECT_EQ((*merged)[0].x, 1.0F);
  EXPECT_EQ((*merged)[1].x, 7.0F);
  const auto node =
      core::parse_yaml("chain: test\nfilters:\n  - {type: tee, file: " + worlds::temporary("never.ply") +
                           "}\n  - {type: merge, file: /no/such/cloud.ply}\n",
                       "test.yaml");
  ASSERT_TRUE(node);
  core::ConfigProblems problems;
  const auto chain = FilterChain::parse(*node, "", builtin_filters(), problems);
  ASSERT_TRUE(problems.empty()) << core::to_string(problems);
  std::filesystem::remove(worlds::temporary("never.ply"));
  const auto result = chain.apply(cloud);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().kind, core::ErrorKind::kInput);
  EXPECT_EQ(result.error().message, "chain test: filters[1] (merge): /no/such/cloud.ply: no such file");
  EXPECT_FALSE(std::filesystem::exists(worlds::temporary("never.ply")))
      << "nothing starts before all is there";
}

TEST(Segments, TeeWritesWhatPassesAndNumbersItsRuns) {
  const std::string file = worlds::temporary("tap.pcd");
  auto cloud = list({point(1, 2, 3)});
  EXPECT_EQ(must("{type: tee, file: " + file + "}", cloud)->size(), 1U);
  FilterContext context;
  context.run = "12";
  EXPECT_EQ(must("{type: tee, file: " + file + "}", cloud, context)->size(), 1U);
  for (const std::string& written : {file, worlds::temporary("tap_12.pcd")}) {
    const auto back = read_cloud(written);
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ((*back->cloud)[0].z, 3.0F);
  }
  EXPECT_FALSE(run("{type: tee, file: cloud.obj}", cloud));
  const auto nowhere = run("{type: tee, file: /no/such/folder/a.ply}", cloud);
  ASSERT_FALSE(nowhere);
  EXPECT_EQ(nowhere.error().kind, core::ErrorKind::kOutput);
}

TEST(Segments, TwoTeesMayNotWriteOneFile) {
  const auto node = core::parse_yaml(
      "chain: test\nfilters:\n  - {type: tee, file: a.ply}\n  - {type: tee, file: b.ply}\n"
      "  - {type: tee, file: ./a.ply}\n",
      "test.yaml");
  core::ConfigProblems problems;
  const auto chain = FilterChain::parse(*node, "", builtin_filters(), problems);
  EXPECT_NE(
      core::to_string(problems).find("test.yaml:5:5: filters[2]: ./a.ply is written by an earlier filter"),
      std::string::npos)
      << core::to_string(problems);
  EXPECT_EQ(chain.writes().size(), 3U);
}

}  // namespace
}  // namespace plumbline::cloud
