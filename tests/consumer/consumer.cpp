// SPDX-License-Identifier: BSD-3-Clause
// Thins a cloud with the installed filters, writes and reads it back: consumer OUT-FOLDER
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <cstdio>
#include <filesystem>
#include <memory>

#include "plumbline/cloud/io/cloud_io.hpp"
#include "plumbline/core/version.hpp"
#include "plumbline/plumbline.hpp"

using namespace plumbline;

namespace {

/// One square metre at 1 m, a point every 5 mm.
cloud::CloudPtr make_wall() {
  auto wall = std::make_shared<cloud::Cloud>();
  for (int y = 0; y < 200; ++y) {
    for (int x = 0; x < 200; ++x) {
      cloud::Point p;
      p.getVector3fMap() =
          Eigen::Vector3f(0.005F * static_cast<float>(x), 0.005F * static_cast<float>(y), 1.0F);
      p.getNormalVector3fMap() = -Eigen::Vector3f::UnitZ();
      p.r = p.g = p.b = 128;
      wall->push_back(p);
    }
  }
  return wall;
}

int fail(const core::Error& error) {
  std::fprintf(stderr, "%s\n", error.message.c_str());
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  const std::filesystem::path out = argv[1];
  const auto thin = filter(make_wall(), "[{type: voxel_grid, leaf: 2 cm}]");
  if (!thin) return fail(thin.error());
  if (auto written = cloud::write_cloud(out / "thin.ply", **thin); !written) return fail(written.error());
  const auto back = cloud::read_cloud(out / "thin.ply");
  if (!back) return fail(back.error());

  std::printf("plumbline %s kept %zu of 40000 points\n", core::version(), back->cloud->size());
  return back->cloud->size() >= 2500 && back->cloud->size() < 3000 ? 0 : 1;
}
