// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>

#include "evaluate_worlds.hpp"
#include "plumbline/evaluate/cloud.hpp"
#include "plumbline/evaluate/companions.hpp"
#include "plumbline/evaluate/surface.hpp"

namespace {

namespace fs = std::filesystem;
using namespace plumbline;
using namespace plumbline::evaluate;
using namespace plumbline::evaluate::worlds;

class Files : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / (std::string("plumbline_evaluate_") +
                                           ::testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path write(const std::string& name, const std::string& text) const {
    fs::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return folder_ / name;
  }
  fs::path folder_;
};

using LoadReference = Files;
using FindTrajectories = Files;

template <typename T>
std::string bytes_of(T value) {
  std::string out(sizeof(T), '\0');
  std::memcpy(out.data(), &value, sizeof(T));
  return out;
}

const char* const kSquare =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n";

std::string binary_samples(std::size_t promised, std::size_t written, float third_x) {
  std::string text =
      "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(promised) +
      "\nproperty float x\nproperty float y\nproperty float z\nproperty float nx\nproperty float ny\n"
      "property float nz\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
      "property uchar visible\nend_header\n";
  for (std::size_t i = 0; i < written; ++i) {
    text += bytes_of(i == 2 ? third_x : static_cast<float>(i)) + bytes_of(0.5F) + bytes_of(-1.0F);
    text += bytes_of(0.0F) + bytes_of(0.0F) + bytes_of(2.0F);  // not of unit length
    text += std::string("\x10\x20\x30", 3) + std::string(1, static_cast<char>(i % 2));
  }
  return text;
}

TEST_F(LoadReference, AsciiMeshWithAPolygon) {
  const auto reference = load_reference(write("square.ply", kSquare));
  ASSERT_TRUE(reference) << reference.error().message;
  EXPECT_EQ(reference->mesh.vertices.size(), 4U);
  EXPECT_EQ(reference->mesh.triangles.size(), 2U);
  SurfaceSamples cloud = plane(1.0, 0.25, 0.1);
  const auto report = evaluate_cloud(cloud, &*reference, {}, {}, core::Executor(1));
  ASSERT_TRUE(report);
  EXPECT_NEAR(report->accuracy_mm.max, 250.0, 1e-3);
}

TEST_F(LoadReference, BinarySamplesWithNormalsAndVisibility) {
  const auto reference = load_reference(write("samples.ply", binary_samples(5, 5, 2.0F)));
  ASSERT_TRUE(reference) << reference.error().message;
  const SurfaceSamples& s = reference->samples;
  ASSERT_EQ(s.points.size(), 5U);
  EXPECT_EQ(s.points[4], Eigen::Vector3f(4.0F, 0.5F, -1.0F));
  EXPECT_EQ(s.normals[1], Eigen::Vector3f::UnitZ().eval());
  EXPECT_EQ(s.visible, (std::vector<std::uint8_t>{0, 1, 0, 1, 0}));
  EXPECT_TRUE(reference->mesh.triangles.empty());
}

TEST_F(LoadReference, SaysWhatIsWrongAndWhere) {
  const auto message = [this](const std::string& name, const std::string& text) {
    const fs::path file = write(name, text);
    const auto reference = load_reference(file);
    EXPECT_FALSE(reference) << name;
    if (reference) return std::string();
    EXPECT_EQ(reference.error().kind, core::ErrorKind::kInput) << name;
    EXPECT_NE(reference.error().message.find(file.filename().string()), std::string::npos) << name;
    EXPECT_EQ(reference.error().message.find('\n'), std::string::npos) << name;
    return reference.error().message;
  };
  const float nan = std::nanf("");
  EXPECT_NE(message("nan.ply", binary_samples(5, 5, nan)).find("1 of 5 points"), std::string::npos);
  message("truncated.ply", binary_samples(5, 3, 2.0F));
  message("boastful.ply", binary_samples(4000000000U, 3, 2.0F));
  message("none.ply", binary_samples(0, 0, 0.0F));
  message("empty.ply", "");
  message("text.ply", "this is no cloud\n");
  std::string face(kSquare);
  message("face.ply", face.replace(face.find("4 0 1 2 3"), 9, "4 0 1 2 9"));
  message("flat.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n");
  const auto missing = load_reference(folder_ / "missing.ply");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().kind, core::ErrorKind::kInput);
}

TEST_F(LoadReference, TheCloudUnderTestKeepsPointsThatAreNotFinite) {
  const auto cloud = load_cloud(write("cloud.ply", binary_samples(5, 5, std::nanf(""))));
  ASSERT_TRUE(cloud) << cloud.error().message;
  ASSERT_EQ(cloud->points.size(), 5U);
  EXPECT_FALSE(cloud->points[2].allFinite());
  EXPECT_EQ(cloud->normals[0], Eigen::Vector3f::UnitZ().eval());
}

TEST_F(LoadReference, LargeCoordinatesKeepTheirDigits) {
  const std::string points = "701362.56 4485513.72 100.00\n701362.57 4485513.72 100.00\n";
  const std::string header =
      "ply\nformat ascii 1.0\nelement vertex 2\nproperty double x\nproperty double y\nproperty double z\n"
      "end_header\n";
  const Eigen::Vector3d shift(701362, 4485513, 0);
  for (const auto& file : {write("utm.ply", header + points), write("utm.xyz", points)}) {
    const auto reference = load_reference(file);
    const auto cloud = load_cloud(file);
    ASSERT_TRUE(reference && cloud) << file;
    EXPECT_EQ(reference->shift, shift);
    EXPECT_EQ(cloud->shift, shift);
    for (const SurfaceSamples& samples : {reference->samples, *cloud})
      EXPECT_NEAR((samples.points[1] - samples.points[0]).norm(), 0.01, 1e-6) << file;
  }
}

TEST_F(FindTrajectories, OneRobot) {
  const fs::path cloud = write("map/map.ply", "");
  const fs::path reference = write("world/reference.ply", "");
  EXPECT_TRUE(find_trajectories(cloud, reference).empty());
  const fs::path estimate = write("map/trajectory.txt", "");
  EXPECT_TRUE(find_trajectories(cloud, reference).empty());
  const fs::path robot_truth = write("world/robot0/groundtruth.txt", "");
  auto found = find_trajectories(cloud, reference);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].estimate, estimate);
  EXPECT_EQ(found[0].truth, robot_truth);
  write("world/robot1/groundtruth.txt", "");  // whose path it is would be a guess
  EXPECT_TRUE(find_trajectories(cloud, reference).empty());
  const fs::path truth = write("world/groundtruth.txt", "");
  found = find_trajectories(cloud, reference);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].truth, truth);
}

TEST_F(FindTrajectories, SeveralRobotsByName) {
  const fs::path cloud = write("map/map.ply", "");
  const fs::path reference = write("world/reference.ply", "");
  for (const char* robot : {"robot1", "robot0", "stranger"}) {
    write(std::string("map/robots/") + robot + "/trajectory.txt", "");
  }
  for (const char* robot : {"robot0", "robot1", "robot2"})
    write(std::string("world/") + robot + "/groundtruth.txt", "");
  const auto found = find_trajectories(cloud, reference);
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].robot, "robot0");
  EXPECT_EQ(found[1].robot, "robot1");
  EXPECT_EQ(found[1].estimate, folder_ / "map/robots/robot1/trajectory.txt");
  EXPECT_EQ(found[1].truth, folder_ / "world/robot1/groundtruth.txt");
}

TEST(SampleMesh, AboutOneSampleToEverySquare) {
  const SurfaceSamples samples = sample_mesh(box_mesh({1.0F, 0.5F, 2.0F}), 0.02);
  EXPECT_NEAR(static_cast<double>(samples.points.size()), 7.0 / 0.0004, 2.0);
  for (const auto& n : samples.normals) ASSERT_NEAR(n.norm(), 1.0F, 1e-6F);
  // Evenly: of the 10 cm squares of one face none is much fuller or emptier than another.
  std::array<int, 100> count{};
  const SurfaceSamples square = sample_mesh(square_mesh(1.0F), 0.01);
  for (const auto& p : square.points) {
    const auto x = std::min(9, static_cast<int>(10.0F * p.x()));
    const auto y = std::min(9, static_cast<int>(10.0F * p.y()));
    ++count[static_cast<std::size_t>(10 * x + y)];
  }
  for (const int n : count) EXPECT_NEAR(n, 100, 15);
}

TEST(SampleMesh, VisibilityComesFromTheNearestVertex) {
  TriangleMesh mesh = square_mesh(1.0F);
  mesh.visible = {1, 0, 0, 1};
  const SurfaceSamples samples = sample_mesh(mesh, 0.02);
  ASSERT_EQ(samples.visible.size(), samples.points.size());
  int wrong = 0;
  for (std::size_t i = 0; i < samples.points.size(); ++i) {
    if (std::abs(samples.points[i].x() - 0.5F) < 0.3F) continue;
    wrong += (samples.visible[i] != 0) != (samples.points[i].x() < 0.5F) ? 1 : 0;
  }
  EXPECT_EQ(wrong, 0);
}

}  // namespace
