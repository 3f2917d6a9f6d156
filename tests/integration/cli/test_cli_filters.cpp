// SPDX-License-Identifier: BSD-3-Clause
// Chains give what PCL's own command-line tools give, point for point, where both exist.
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "plumbline/cloud/io/cloud_io.hpp"
#include "program.hpp"

namespace plumbline::integration {
namespace {

using cloud::Point;

class FilterTools : public ProgramTest {
 protected:
  void SetUp() override {
    if (std::system("command -v pcl_voxel_grid >/dev/null 2>&1") != 0)
      GTEST_SKIP() << "pcl-tools is not installed";
    // A noisy bowl on a floor, an island and some dust.
    std::mt19937 random(7);
    std::normal_distribution<float> noise(0.0F, 0.004F);
    std::uniform_real_distribution<float> place(-0.5F, 0.5F);
    cloud::Cloud world;
    const auto add = [&world](float x, float y, float z) {
      Point p;
      p.x = x;
      p.y = y;
      p.z = z;
      p.r = p.g = p.b = 77;
      world.push_back(p);
    };
    for (int i = 0; i < 4000; ++i) {
      const float x = place(random);
      const float y = place(random);
      add(x, y, noise(random) + (i % 4 == 0 ? 0.3F + x * x + y * y : 0.0F));
    }
    for (int i = 0; i < 400; ++i)
      add(2.0F + 0.2F * place(random), 0.2F * place(random), 0.2F * place(random));
    for (int i = 0; i < 60; ++i) add(4.0F * place(random), 4.0F * place(random), 4.0F * place(random));
    ASSERT_TRUE(cloud::write_pcd(path("in.pcd"), world));
  }

  /// Both outputs, sorted when the order is PCL's hash table's. An empty `filter`: chain.yaml as it is.
  void compare(const std::string& filter, const std::string& tool, const std::string& result = "pcl.pcd",
               double tolerance = 0.0, bool sorted = false, std::size_t less_than = 4461) const {
    if (!filter.empty()) write("chain.yaml", "chain: one\nfilters:\n  - " + filter + "\n");
    const auto ours = run("filter chain.yaml in.pcd ours.pcd");
    ASSERT_EQ(ours.code, 0) << filter << "\n" << ours;
    const std::string command = "cd '" + path("").string() + "' && pcl_" + tool + " >pcl.txt 2>&1 </dev/null";
    ASSERT_EQ(std::system(command.c_str()), 0) << tool << "\n" << slurp(path("pcl.txt"));
    const auto a = cloud::read_cloud(path("ours.pcd"));
    const auto b = cloud::read_cloud(path(result));
    ASSERT_TRUE(a && b) << tool << "\n" << slurp(path("pcl.txt"));
    std::vector<Eigen::Vector3f> left = points(*a->cloud, sorted);
    std::vector<Eigen::Vector3f> right = points(*b->cloud, sorted);
    ASSERT_EQ(left.size(), right.size()) << filter << "\n" << slurp(path("pcl.txt"));
    EXPECT_GT(left.size(), 50U) << filter << ": too few points to say much";
    EXPECT_LT(left.size(), less_than) << filter;
    double worst = 0.0;
    for (std::size_t i = 0; i < left.size(); ++i) {
      worst = std::max(worst, static_cast<double>((left[i] - right[i]).cwiseAbs().maxCoeff()));
    }
    EXPECT_LE(worst, tolerance) << filter;
  }

  static std::vector<Eigen::Vector3f> points(const cloud::Cloud& cloud, bool sorted) {
    std::vector<Eigen::Vector3f> found;
    for (const Point& p : cloud.points) {
      if (std::isfinite(p.x)) found.emplace_back(p.getVector3fMap());
    }
    if (sorted) {
      std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) {
        return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
      });
    }
    return found;
  }
};

TEST_F(FilterTools, VoxelGrid) {
  compare("{type: voxel_grid, leaf: 5 cm}", "voxel_grid in.pcd pcl.pcd -leaf 0.05,0.05,0.05", "pcl.pcd",
          1e-6);
}

TEST_F(FilterTools, StatisticalOutlier) {
  compare("{type: statistical_outlier, neighbours: 8, deviations: 1}",
          "outlier_removal in.pcd pcl.pcd -method statistical -mean_k 8 -std_dev_mul 1");
}

TEST_F(FilterTools, RadiusOutlier) {
  compare("{type: radius_outlier, radius: 5 cm, min_neighbours: 12}",
          "outlier_removal in.pcd pcl.pcd -method radius -radius 0.05 -min_pts 12");
}

TEST_F(FilterTools, PassThrough) {
  compare("{type: pass_through, field: x, min: -0.25, max: 0.3}",
          "passthrough_filter in.pcd pcl.pcd -field x -min -0.25 -max 0.3");
  compare("{type: pass_through, field: x, min: -0.25, max: 0.3, inside: off}",
          "passthrough_filter in.pcd pcl.pcd -field x -min -0.25 -max 0.3 -inside 0");
}

TEST_F(FilterTools, UniformSampling) {
  compare("{type: uniform_sampling, leaf: 7 cm}", "uniform_sampling in.pcd pcl.pcd -radius 0.07", "pcl.pcd",
          0.0, true);
}

TEST_F(FilterTools, MovingLeastSquares) {
  compare("{type: mls, radius: 10 cm, order: 2}",
          "mls_smoothing in.pcd pcl.pcd -radius 0.1 -sqr_gauss_param 0.01 -polynomial_order 2", "pcl.pcd",
          1e-6);
}

TEST_F(FilterTools, Normals) {
  compare("{type: normals, neighbours: 10}", "normal_estimation in.pcd pcl.pcd -k 10");
  const auto ours = cloud::read_cloud(path("ours.pcd"));
  const auto theirs = cloud::read_cloud(path("pcl.pcd"));
  ASSERT_TRUE(ours && theirs);
  for (std::size_t i = 0; i < ours->cloud->size(); ++i) {
    const Point& a = (*ours->cloud)[i];
    const Point& b = (*theirs->cloud)[i];
    ASSERT_LT((a.getNormalVector3fMap() - b.getNormalVector3fMap()).norm(), 1e-4F) << i;
    ASSERT_NEAR(a.curvature, b.curvature, 1e-5F) << i;
  }
}

TEST_F(FilterTools, NormalsWithinARadius) {
  compare("{type: normals, neighbours: 0, radius: 6 cm}", "normal_estimation in.pcd pcl.pcd -radius 0.06");
  const auto ours = cloud::read_cloud(path("ours.pcd"));
  const auto theirs = cloud::read_cloud(path("pcl.pcd"));
  ASSERT_TRUE(ours && theirs);
  for (std::size_t i = 0; i < ours->cloud->size(); ++i) {
    const Point& a = (*ours->cloud)[i];
    const Point& b = (*theirs->cloud)[i];
    ASSERT_EQ(std::isfinite(a.normal_x), std::isfinite(b.normal_x)) << i;
    if (std::isfinite(a.normal_x)) {
      ASSERT_LT((a.getNormalVector3fMap() - b.getNormalVector3fMap()).norm(), 1e-4F) << i;
    }
  }
}

TEST_F(FilterTools, Plane) {
  compare("{type: plane, distance: 1 cm, refine: spread}",
          "sac_segmentation_plane in.pcd pcl.pcd -thresh 0.01");
  compare("{type: plane, distance: 5 cm, iterations: 50, refine: spread}",
          "sac_segmentation_plane in.pcd pcl.pcd -thresh 0.05 -max_it 50");
}

TEST_F(FilterTools, VoxelGridBetweenLimits) {
  write("chain.yaml",
        "chain: two\nfilters:\n  - {type: pass_through, field: z, min: -0.1, max: 0.4}\n"
        "  - {type: voxel_grid, leaf: 5 cm}\n");
  compare("", "voxel_grid in.pcd pcl.pcd -leaf 0.05,0.05,0.05 -field z -fmin -0.1 -fmax 0.4", "pcl.pcd",
          1e-6);
}

TEST_F(FilterTools, Merge) {
  write("chain.yaml", "chain: move\nfilters:\n  - {type: transform, translation: [9 m, 0 m, 0 m]}\n");
  ASSERT_EQ(run("filter chain.yaml in.pcd other.pcd").code, 0);
  compare("{type: merge, file: other.pcd}", "concatenate_points_pcd in.pcd other.pcd", "output.pcd", 0.0,
          false, 9000);
}

TEST_F(FilterTools, Clusters) {
  compare("{type: clusters, distance: 6 cm, min_points: 100, count: 1}",
          "cluster_extraction in.pcd pcl.pcd -min 100 -max 100000 -tolerance 0.06", "pcl0.pcd", 1e-6, true);
}

TEST_F(FilterTools, Transform) {
  compare("{type: transform, translation: [1 m, 2 m, 3 m], rotation: [0 deg, 0 deg, 30 deg]}",
          "transform_point_cloud in.pcd pcl.pcd -trans 1,2,3 -axisangle 0,0,1,0.5235987756", "pcl.pcd", 1e-5);
}

class FilterRuns : public ProgramTest {};

TEST_F(FilterRuns, SeveralInputsAreOneCloudAndTheTableSaysWhatHappened) {
  write("a.xyz", "0 0 1\n1 0 1\n");
  write("b.csv", "x,y,z\n2,0,1\n3,0,9\n");
  write("chain.yaml",
        "chain: a\nfilters:\n  - {type: tee, file: all.ply}\n  - {type: pass_through, max: 3}\n");
  const auto ran = run("filter chain.yaml a.xyz b.csv out.ply");
  EXPECT_EQ(ran.code, 0) << ran;
  EXPECT_NE(ran.out.find("filter"), std::string::npos);
  EXPECT_NE(ran.out.find("pass_through                       4           3"), std::string::npos) << ran;
  EXPECT_EQ(cloud::read_cloud(path("all.ply"))->cloud->size(), 4U);
  EXPECT_EQ(cloud::read_cloud(path("out.ply"))->cloud->size(), 3U);
}

TEST_F(FilterRuns, ColumnsOfOtherNamesGoWithTheirPoints) {
  write("a.csv", "x,y,z,intensity\n0,0,1,10\n1,0,1,20\n2,0,1,30\n");
  write("b.csv", "x,y,z,confidence\n3,0,1,0.5\n");
  write("chain.yaml", "chain: a\nfilters:\n  - {type: pass_through, column: intensity, min: 15, max: 99}\n");
  const auto ran = run("filter chain.yaml a.csv b.csv out.ply");
  ASSERT_EQ(ran.code, 0) << ran;
  const auto out = cloud::read_cloud(path("out.ply"));
  ASSERT_TRUE(out);
  ASSERT_EQ(out->columns.others.size(), 1U);
  EXPECT_EQ(out->columns.others[0].name, "intensity");
  EXPECT_EQ(out->columns.others[0].values, (std::vector<float>{20.0F, 30.0F}));
  EXPECT_EQ(out->columns.confidence, (std::vector<float>{0.0F, 0.0F}));
}

const char* const kUtm =
    "ply\nformat ascii 1.0\ncomment Generated by the CGAL library\nelement vertex 4\nproperty double "
    "x\nproperty double "
    "y\nproperty double z\nend_header\n701362.56 4485513.72 100.00\n701362.57 4485513.72 100.00\n701362.56 "
    "4485513.73 "
    "100.00\n701362.57 4485513.73 100.01\n";

TEST_F(FilterRuns, LargeCoordinatesKeepTheirDigits) {
  write("utm.ply", kUtm);
  write("voxel.yaml", "chain: v\nfilters:\n  - {type: voxel_grid, leaf: 5 mm}\n");
  const auto info = run("info utm.ply");
  EXPECT_NE(info.out.find("points: 4"), std::string::npos) << info;
  EXPECT_NE(info.out.find("size: 0.010 x 0.010 x 0.010 m"), std::string::npos) << info;
  EXPECT_NE(info.out.find("from: 701362.560 4485513.720 100.000 m"), std::string::npos) << info;
  EXPECT_NE(info.out.find("shift: 701362 4485513 0 m"), std::string::npos) << info;
  const auto voxels = run("filter voxel.yaml utm.ply out.ply");
  ASSERT_EQ(voxels.code, 0) << voxels;
  EXPECT_NE(voxels.out.find("shift: 701362 4485513 0 m"), std::string::npos) << voxels;
  EXPECT_NE(run("info out.ply").out.find("to: 701362.570 4485513.730 100.010 m"), std::string::npos);
  EXPECT_EQ(cloud::read_cloud(path("out.ply"))->cloud->size(), 4U);

  write(
      "move.yaml",
      "chain: m\nfilters:\n  - {type: crop_box, min: [701362.565, 4485513, 0], max: [701363, 4485514, 200]}\n"
      "  - {type: pass_through, field: y, min: 4485513.725, max: 4485514}\n  - {type: merge, file: utm.ply}\n"
      "  - {type: tee, file: tee.ply}\n  - {type: transform, translation: [0 m, 0 m, 1 m], rotation: [0 deg, "
      "0 deg, 90 "
      "deg]}\n");
  const auto moved = run("filter move.yaml utm.ply moved.ply");
  ASSERT_EQ(moved.code, 0) << moved;
  EXPECT_EQ(cloud::read_cloud(path("moved.ply"))->cloud->size(), 5U);
  const auto tee = run("info tee.ply");
  EXPECT_NE(tee.out.find("from: 701362.560 4485513.720 100.000 m"), std::string::npos) << tee;
  const auto exported = run("export utm.ply -o utm.pcd");
  ASSERT_EQ(exported.code, 0) << exported;
  EXPECT_NE(run("info utm.pcd").out.find("from: 701362.560 4485513.720 100.000 m"), std::string::npos);
  const auto drawn = run("render utm.ply -o utm.png");
  EXPECT_EQ(drawn.code, 0) << drawn;
  EXPECT_TRUE(drawn.told("shift: 701362 4485513 0 m")) << drawn;

  const auto measured = run("evaluate cloud utm.ply utm.ply --json");
  ASSERT_EQ(measured.code, 0) << measured;
  EXPECT_TRUE(measured.told("shift: 701362 4485513 0 m")) << measured;
  const auto report = nlohmann::json::parse(measured.out);
  EXPECT_NEAR(report["density"]["spacing_mm"], 10.0, 0.01) << measured;
  EXPECT_EQ(report["accuracy_mm"]["max"], 0.0) << measured;
}

TEST_F(FilterRuns, CloudsFarApartAreNotMerged) {
  write("utm.ply", kUtm);
  write("local.xyz", "0 0 1\n1 0 1\n");
  write("voxel.yaml", "chain: v\nfilters:\n  - {type: voxel_grid, leaf: 5 mm}\n");
  const auto merged = run("filter voxel.yaml local.xyz utm.ply out.ply");
  EXPECT_EQ(merged.code, 3) << merged;
  EXPECT_TRUE(merged.told("local.xyz and utm.ply lie 4540 km apart")) << merged;
  EXPECT_FALSE(fs::exists(path("out.ply")));
}

TEST_F(FilterRuns, ChainThatLeavesNothingIsNotTrusted) {
  write("a.xyz", "0 0 1\n1 0 1\n");
  write("chain.yaml",
        "chain: none\nfilters:\n  - {type: pass_through, field: x, max: 0.5}\n  - {type: pass_through, min: "
        "5}\n"
        "  - {type: voxel_grid, leaf: 1 cm}\n");
  const auto ran = run("filter chain.yaml a.xyz out.ply");
  EXPECT_EQ(ran.code, 4) << ran;
  EXPECT_TRUE(ran.told("filters[1] (pass_through) took the last of 1 points")) << ran;
  EXPECT_EQ(cloud::read_cloud(path("out.ply"))->cloud->size(), 0U);
  EXPECT_EQ(run("info out.ply").out, "points: 0\nnote: the cloud is empty\n");
  const auto drawn = run("render out.ply -o out.png");
  EXPECT_EQ(drawn.code, 0) << drawn;
  EXPECT_TRUE(drawn.told("out.ply: the cloud has no points")) << drawn;
}

TEST_F(FilterRuns, NothingIsReadOrWrittenWhenTheCommandCannotEndWell) {
  write("a.xyz", "0 0 1\n");
  write("tee.yaml", "chain: a\nfilters:\n  - {type: tee, file: ./out.ply}\n");
  write("merge.yaml",
        "chain: a\nfilters:\n  - {type: tee, file: t.ply}\n  - {type: merge, file: gone.ply}\n");
  const auto same = run("filter tee.yaml a.xyz out.ply");
  EXPECT_EQ(same.code, 2) << same;
  EXPECT_TRUE(same.told("a filter of the chain writes this file already")) << same;
  const auto gone = run("filter merge.yaml a.xyz out.ply");
  EXPECT_EQ(gone.code, 3) << gone;
  EXPECT_TRUE(gone.told("filters[1] (merge): gone.ply: no such file")) << gone;
  EXPECT_EQ(run("filter merge.yaml a.xyz out.obj").code, 2);
  EXPECT_EQ(run("filter merge.yaml a.xyz no/folder/out.ply").code, 5);
  EXPECT_EQ(run("filter merge.yaml a.xyz").code, 2);
  EXPECT_FALSE(fs::exists(path("t.ply")) || fs::exists(path("out.ply")));
}

}  // namespace
}  // namespace plumbline::integration
