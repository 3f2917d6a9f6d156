// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "plumbline/cloud/io/mesh.hpp"
#include "test_cloud_worlds.hpp"

namespace plumbline::cloud {
namespace {

/// The upper half of a sphere around (1, 2, 3), points evenly spread, seen from outside.
Cloud dome(double radius_m, std::size_t points) {
  Cloud cloud;
  const double golden = M_PI * (3.0 - std::sqrt(5.0));
  for (std::size_t i = 0; i < points; ++i) {
    const double z = (static_cast<double>(i) + 0.5) / static_cast<double>(points);
    const double angle = golden * static_cast<double>(i);
    const double across = std::sqrt(1.0 - z * z);
    const Eigen::Vector3f n(static_cast<float>(across * std::cos(angle)),
                            static_cast<float>(across * std::sin(angle)), static_cast<float>(z));
    const Eigen::Vector3f p = Eigen::Vector3f(1, 2, 3) + static_cast<float>(radius_m) * n;
    cloud.push_back(worlds::point(p.x(), p.y(), p.z(), n, 77));
  }
  return cloud;
}

TEST(Mesh, LiesOnTheSurfaceAndIsOpenWhereNothingWasSeen) {
  const auto mesh = make_mesh(dome(0.5, 20000));
  ASSERT_TRUE(mesh.has_value());
  EXPECT_GT(mesh->triangles.size(), 2000U);
  const auto &x = *mesh->floats("x"), &y = *mesh->floats("y"), &z = *mesh->floats("z");
  for (std::size_t i = 0; i < mesh->vertex_count; ++i) {
    EXPECT_NEAR(std::hypot(x[i] - 1.0F, y[i] - 2.0F, z[i] - 3.0F), 0.5F, 0.05F);
    EXPECT_GT(z[i], 2.94F);
    EXPECT_EQ((*mesh->bytes("red"))[i], 77);
  }
  for (const auto& triangle : mesh->triangles) {
    for (const std::uint32_t corner : triangle) ASSERT_LT(corner, mesh->vertex_count);
  }
}

TEST(Mesh, SameCloudSameMesh) {
  const auto a = make_mesh(dome(0.3, 3000));
  const auto b = make_mesh(dome(0.3, 3000));
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->triangles, b->triangles);
  EXPECT_EQ(*a->floats("x"), *b->floats("x"));
}

TEST(Mesh, WhatCannotBeMeshedIsSaid) {
  EXPECT_EQ(make_mesh(Cloud()).error().kind, core::ErrorKind::kUsage);
  MeshOptions fine;
  fine.resolution_m = 0.001;
  Cloud wide = dome(0.3, 300);
  wide.push_back(worlds::point(100, 0, 0));
  const auto failed = make_mesh(wide, fine);
  ASSERT_FALSE(failed.has_value());
  EXPECT_NE(failed.error().message.find("too fine"), std::string::npos);
}

TEST(Mesh, FilesByTheirEnding) {
  const auto mesh = make_mesh(dome(0.3, 3000));
  ASSERT_TRUE(mesh.has_value());
  const auto folder = std::filesystem::temp_directory_path() / "plumbline_test_mesh";
  std::filesystem::create_directories(folder);
  ASSERT_TRUE(write_mesh(folder / "m.ply", *mesh).has_value());
  const auto back = read_ply(folder / "m.ply");
  ASSERT_TRUE(back.has_value());
  EXPECT_EQ(back->triangles, mesh->triangles);
  ASSERT_TRUE(write_mesh(folder / "m.obj", *mesh).has_value());
  const std::string text = worlds::slurp(folder / "m.obj");
  EXPECT_EQ(static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n')),
            1 + 2 * mesh->vertex_count + mesh->triangles.size());
  EXPECT_EQ(write_mesh(folder / "m.stl", *mesh).error().kind, core::ErrorKind::kUsage);
  EXPECT_EQ(write_mesh("/no/such/m.obj", *mesh).error().kind, core::ErrorKind::kOutput);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace plumbline::cloud
