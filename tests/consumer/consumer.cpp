// SPDX-License-Identifier: BSD-3-Clause
// Thins a cloud with the installed filters, draws it off-screen, reads it back: consumer OUT-FOLDER
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <cstdio>
#include <filesystem>
#include <memory>

#include "plumbline/cloud/filters/filter_chain.hpp"
#include "plumbline/cloud/io/cloud_io.hpp"
#include "plumbline/core/version.hpp"
#include "plumbline/viz/snapshot.hpp"

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
  core::ConfigProblems problems;
  const auto yaml =
      core::parse_yaml("chain: thin\nfilters:\n  - type: voxel_grid\n    leaf: 2 cm\n", "thin.yaml");
  if (!yaml) return fail(yaml.error());
  const auto chain = cloud::FilterChain::parse(*yaml, "", cloud::builtin_filters(), problems);
  if (!problems.empty()) return fail(core::to_error(problems));
  const auto thin = chain.apply(make_wall());
  if (!thin) return fail(thin.error());
  if (auto written = cloud::write_cloud(out / "thin.ply", **thin); !written) return fail(written.error());
  const auto back = cloud::read_cloud(out / "thin.ply");
  if (!back) return fail(back.error());

  viz::Scene scene;
  scene.cloud = back->cloud;
  viz::SnapshotOptions options;
  options.view = viz::View::kFront;
  options.width_px = 320;
  options.height_px = 240;
  if (auto drawn = viz::render_snapshot(scene, options, out / "thin.png"); !drawn) return fail(drawn.error());
  std::printf("plumbline %s kept %zu of 40000 points\n", core::version(), back->cloud->size());
  return back->cloud->size() >= 2500 && back->cloud->size() < 3000 ? 0 : 1;
}
