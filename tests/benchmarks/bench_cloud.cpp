// SPDX-License-Identifier: BSD-3-Clause
// What a keyframe costs: organised cloud, filter chain, fusion; and files.
//   build/release/tests/benchmarks/bench_cloud
#include <benchmark/benchmark.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <random>

#include "plumbline/cloud/filters/filter_chain.hpp"
#include "plumbline/cloud/fusion/keyframe_cloud.hpp"
#include "plumbline/cloud/fusion/voxel_map.hpp"
#include "plumbline/sensor/depth_noise.hpp"

namespace {

using namespace plumbline;

const sensor::Pinhole kCamera{640, 480, 525.0, 525.0, 319.5, 239.5};

/// A room's corner with floor and a box in front of it, noise of structured light, 5 % holes.
sensor::RgbdFrame room() {
  std::mt19937 random(1);
  std::normal_distribution<double> gauss;
  std::uniform_int_distribution<int> percent(0, 99);
  sensor::RgbdFrame frame;
  frame.color = cv::Mat(480, 640, CV_8UC3, cv::Scalar(90, 120, 150));
  frame.depth = cv::Mat(480, 640, CV_32FC1, cv::Scalar(0));
  const std::array<Eigen::Vector3d, 3> walls{Eigen::Vector3d(0.7, 0.1, 0.7).normalized(),
                                             Eigen::Vector3d(-0.6, 0.1, 0.8).normalized(),
                                             Eigen::Vector3d(0.0, 0.95, 0.3).normalized()};
  const std::array<double, 3> distances{2.0, 1.8, 1.2};
  for (int v = 0; v < 480; ++v) {
    for (int u = 0; u < 640; ++u) {
      double z = u > 250 && u < 380 && v > 200 && v < 330 ? 1.2 : 10.0;
      for (std::size_t i = 0; i < walls.size(); ++i) {
        const double at = distances[i] / walls[i].dot(kCamera.unproject(u, v, 1.0));
        if (at > 0.0) z = std::min(z, at);
      }
      if (percent(random) >= 5) {
        frame.depth.at<float>(v, u) = static_cast<float>(z + sensor::depth_sigma(z) * gauss(random));
      }
    }
  }
  return frame;
}

cloud::FilterChain chain(const char* name) {
  const auto file = std::filesystem::path(PLUMBLINE_SOURCE_DIR) / "pipelines/filters" / name;
  auto loaded = cloud::FilterChain::load(file, cloud::builtin_filters());
  if (!loaded) throw std::runtime_error(loaded.error().message);
  return *loaded;
}

void organised_cloud(benchmark::State& state) {
  const auto frame = room();
  cloud::KeyframeCloudOptions options;
  options.stride_px = static_cast<int>(state.range(0));
  for (auto _ : state) benchmark::DoNotOptimize(cloud::organised_cloud(frame, kCamera, options));
}
BENCHMARK(organised_cloud)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond);

void keyframe_chain(benchmark::State& state) {
  const auto keyframe = cloud::organised_cloud(room(), kCamera);
  const auto filters = chain("keyframe.yaml");
  std::size_t points = 0;
  for (auto _ : state) points = (*filters.apply(keyframe))->size();
  state.counters["points"] = static_cast<double>(points);
}
BENCHMARK(keyframe_chain)->Unit(benchmark::kMillisecond);

/// The time must not depend on how large the map is already.
void voxel_insert(benchmark::State& state) {
  const auto keyframe = *chain("keyframe.yaml").apply(cloud::organised_cloud(room(), kCamera));
  cloud::VoxelMap map;
  for (int i = 0; i < state.range(0); ++i) {
    map.insert(*keyframe, {Eigen::Matrix3d::Identity(), Eigen::Vector3d(5.0 * i, 0.0, 0.0)});
  }
  for (auto _ : state) map.insert(*keyframe, geometry::Rigid3());
  state.counters["voxels"] = static_cast<double>(map.size());
}
BENCHMARK(voxel_insert)->Arg(1)->Arg(10)->Arg(100)->Unit(benchmark::kMillisecond);

void voxel_extract(benchmark::State& state) {
  const auto keyframe = *chain("keyframe.yaml").apply(cloud::organised_cloud(room(), kCamera));
  cloud::VoxelMap map;
  for (int i = 0; i < 30; ++i) {
    map.insert(*keyframe, {Eigen::Matrix3d::Identity(), Eigen::Vector3d(5.0 * i, 0.0, 0.0)});
  }
  for (auto _ : state) benchmark::DoNotOptimize(map.extract());
  state.counters["points"] = static_cast<double>(map.size());
}
BENCHMARK(voxel_extract)->Unit(benchmark::kMillisecond);

void map_chain(benchmark::State& state) {
  cloud::VoxelMap map;
  map.insert(*cloud::organised_cloud(room(), kCamera), geometry::Rigid3());
  const auto fused = map.extract();
  const auto filters = chain("map.yaml");
  for (auto _ : state) benchmark::DoNotOptimize(filters.apply(fused.cloud));
  state.counters["points"] = static_cast<double>(fused.cloud->size());
}
BENCHMARK(map_chain)->Unit(benchmark::kMillisecond);

void write_and_read(benchmark::State& state) {
  const auto keyframe = cloud::organised_cloud(room(), kCamera);
  const auto file = std::filesystem::temp_directory_path() / "plumbline_bench_cloud.ply";
  for (auto _ : state) {
    if (!cloud::write_ply(file, *keyframe) || !cloud::read_cloud(file)) state.SkipWithError("file");
  }
  std::filesystem::remove(file);
}
BENCHMARK(write_and_read)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
