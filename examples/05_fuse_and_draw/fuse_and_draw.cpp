// SPDX-License-Identifier: BSD-3-Clause
// Fuses frames at known poses in a voxel map and draws the result; no display is needed.
//
//   fuse_and_draw INPUT PIPELINES PICTURE.png
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <cstdio>

#include "plumbline/cloud/fusion/keyframe_cloud.hpp"
#include "plumbline/cloud/fusion/voxel_map.hpp"
#include "plumbline/core/error.hpp"
#include "plumbline/pipeline/input.hpp"
#include "plumbline/viz/snapshot.hpp"

using namespace plumbline;

namespace {

/// Prints the message; returns the exit code that the program uses for this kind of error.
int fail(const core::Error& error) {
  std::fprintf(stderr, "%s\n", error.message.c_str());
  return static_cast<int>(error.kind);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "usage: fuse_and_draw INPUT PIPELINES PICTURE.png\n");
    return 2;
  }

  const std::filesystem::path pipelines = argv[2];
  const core::Executor executor;
  const auto log = core::stderr_log(core::LogLevel::kWarning);
  dataset::OpenOptions open;
  open.cameras_folder = pipelines / "cameras";
  const auto source = pipeline::open_input(argv[1], open, pipelines / "scenes", executor, *log);
  if (!source) return fail(source.error());

  const auto truth = (*source)->truth();
  if (!truth || truth->empty()) {
    std::fprintf(stderr, "%s: comes without truth (groundtruth.txt)\n", argv[1]);
    return static_cast<int>(core::ErrorKind::kInput);
  }

  cloud::VoxelMapOptions voxels;
  voxels.voxel_m = 0.02;
  cloud::VoxelMap map(voxels);
  viz::CameraPath path;

  constexpr std::size_t kEvery = 5;
  for (std::size_t i = 0; i < (*source)->size(); i += kEvery) {
    const auto frame = (*source)->read(i);
    if (!frame) continue;
    const auto world_from_camera = geometry::pose_at(*truth, frame->stamp);
    if (!world_from_camera) continue;
    map.insert(*cloud::organised_cloud(*frame, (*source)->camera().color), *world_from_camera);
    path.trajectory.push_back({frame->stamp, *world_from_camera});
  }

  viz::Scene scene;
  scene.cloud = map.extract().cloud;
  scene.title = (*source)->name();
  scene.paths.push_back(path);
  viz::SnapshotOptions view;
  view.up = Eigen::Vector3d::UnitZ();  // the truth's frame has z up
  if (auto drawn = viz::render_snapshot(scene, view, argv[3]); !drawn) return fail(drawn.error());
  std::printf("%zu points in %s\n", scene.cloud->size(), argv[3]);
}
