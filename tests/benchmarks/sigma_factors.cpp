// SPDX-License-Identifier: BSD-3-Clause
// By how much the standard deviations of points, lines and edges are to be taken larger than at their word
// for covariances of keyframes (mapping::SigmaFactors): the factors under which the errors of the keyframes
// of generated worlds are most likely, and how well sigma then fits worlds that had no say.
//   sigma_factors [--frames N] [--threads N] [--fit FIRST LAST] [--check FIRST LAST] [--scene NAME]...
// Errors are those of positions in the first keyframe's frame, without any alignment; the first keyframe is
// left out. Tables in Markdown; the numbers are the same on every run.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <opencv2/core/utility.hpp>
#include <string>
#include <vector>

#include "plumbline/cloud/keyframe_cloud.hpp"
#include "plumbline/core/executor.hpp"
#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/mapping/local_map_alignment.hpp"
#include "plumbline/mapping/slam.hpp"
#include "plumbline/synth/source.hpp"

namespace {

using namespace plumbline;
using mapping::SigmaFactors;

constexpr std::array<double SigmaFactors::*, 3> kFamilies{&SigmaFactors::points, &SigmaFactors::lines,
                                                          &SigmaFactors::edges};

/// A refined map, and how far its keyframes are off beside the first one.
struct World {
  std::string scene;
  maps::Map map;
  mapping::Cameras cameras;
  std::vector<mapping::PoseEdge> edges;
  std::vector<Eigen::Vector3d> errors;  ///< of positions, camera axes, metres; by keyframe
};

/// Refined as the stage refine does it.
void refine(const std::map<core::KeyframeId, mapping::CoarseSurface>& surfaces, World& world,
            const core::Executor& executor) {
  const auto local_maps = mapping::make_local_maps(world.map, surfaces, {}, executor);
  const auto pairs = mapping::overlapping_pairs(world.map, local_maps, {}, executor);
  const auto alignments = mapping::align_pairs(world.map, local_maps, pairs, {}, executor);
  auto edges = mapping::to_edges(local_maps, pairs, alignments);
  const auto loops = mapping::loop_edges(world.map);
  edges.insert(edges.end(), loops.begin(), loops.end());
  const auto summary = mapping::adjust_map(world.map, world.cameras, edges, {});
  for (std::size_t i = 0; i < edges.size(); ++i) {
    if (summary.extra.empty() || !summary.extra[i].rejected) world.edges.push_back(edges[i]);
  }
}

core::Result<World> mapped(const std::string& scene, int seed, int frames) {
  const std::string url = fmt::format("synth:{}?frames={}&seed={}&sensor=kinect", scene, frames, seed);
  const auto log = core::null_log();
  const core::Executor executor(1);
  const auto source = synth::open_synth(url, PLUMBLINE_SOURCE_DIR "/pipelines/scenes", executor, *log);
  if (!source) return tl::unexpected<core::Error>(source.error());
  const auto truth = (*source)->truth();
  if (!truth) return core::input_error(url + ": without truth");
  const sensor::Camera camera = (*source)->camera();
  const features::FeatureExtractor extractor({}, camera.color);
  mapping::Slam slam({}, camera.color, 0, executor, *log);
  slam.set_camera(camera);
  std::map<core::KeyframeId, mapping::CoarseSurface> surfaces;
  for (std::size_t i = 0; i < (*source)->size(); ++i) {
    const auto frame = (*source)->read(i);
    if (!frame) return tl::unexpected<core::Error>(frame.error());
    const auto report =
        slam.process(*frame, std::make_shared<const features::FrameFeatures>(extractor.extract(*frame)));
    if (!report.keyframe.valid()) continue;
    surfaces[report.keyframe] = mapping::coarse_surface(*cloud::organised_cloud(*frame, camera.color),
                                                        mapping::LocalMapOptions().voxel_m);
  }
  slam.finish();
  World world{scene, slam.map(), {{0, camera.color}}, {}, {}};
  refine(surfaces, world, executor);
  const std::vector<core::KeyframeId> ids = world.map.keyframe_ids();
  const auto true_pose = [&](core::KeyframeId id) {
    return geometry::pose_at(*truth, world.map.keyframe(id).stamp)->inverse();
  };
  for (const core::KeyframeId id : ids) {
    const geometry::Rigid3 found =
        world.map.camera_from_world(id) * world.map.camera_from_world(ids.front()).inverse();
    const geometry::Rigid3 is = true_pose(id) * true_pose(ids.front()).inverse();
    world.errors.emplace_back(geometry::log_se3(found * is.inverse()).head<3>());
  }
  return world;
}

std::vector<mapping::KeyframeAccuracy> accuracy(const World& world, const SigmaFactors& factors) {
  mapping::GlobalAdjustmentOptions options;
  options.sigma_factors = factors;
  return mapping::keyframe_accuracy(world.map, world.cameras, world.edges, options);
}

/// Negative logarithm of the likelihood of the errors; each world counts alike, as its keyframes err alike.
double unlikeliness(const std::vector<World>& worlds, const SigmaFactors& factors,
                    const core::Executor& executor) {
  std::vector<double> sums(worlds.size(), 0.0);
  executor.parallel_for(worlds.size(), [&](std::size_t w) {
    const auto known = accuracy(worlds[w], factors);
    for (std::size_t i = 1; i < known.size(); ++i) {
      const Eigen::Matrix3d covariance = known[i].covariance.topLeftCorner<3, 3>();
      const Eigen::Vector3d& error = worlds[w].errors[i];
      sums[w] += 0.5 * (error.dot(covariance.llt().solve(error)) + std::log(covariance.determinant())) /
                 static_cast<double>(known.size() - 1);
    }
  });
  double sum = 0.0;
  for (const double s : sums) sum += s;
  return sum;
}

/// One family after the other, in steps of the root of 2, until nothing gets better.
SigmaFactors fitted(const std::vector<World>& worlds, const core::Executor& executor) {
  SigmaFactors best;
  double least = unlikeliness(worlds, best, executor);
  for (bool better = true; better;) {
    better = false;
    for (const auto family : kFamilies) {
      for (const double step : {std::sqrt(2.0), std::sqrt(0.5)}) {
        for (;;) {
          SigmaFactors trial = best;
          trial.*family *= step;
          if (trial.*family > 50.0 || trial.*family < 0.2) break;
          const double value = unlikeliness(worlds, trial, executor);
          if (!(value < least)) break;
          least = value;
          best = trial;
          better = true;
        }
      }
    }
  }
  return best;
}

double median(std::vector<double> values) {
  if (values.empty()) return std::nan("");
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

void print_row(const std::string& name, const std::vector<World>& worlds, const SigmaFactors& factors) {
  std::vector<double> errors, sigmas, ratios;
  for (const World& world : worlds) {
    if (name != "all" && world.scene != name) continue;
    const auto known = accuracy(world, factors);
    for (std::size_t i = 1; i < known.size(); ++i) {
      errors.push_back(1e3 * world.errors[i].norm());
      sigmas.push_back(1e3 * known[i].sigma_position_m());
      ratios.push_back(errors.back() / sigmas.back());
    }
  }
  const auto within = std::count_if(ratios.begin(), ratios.end(), [](double r) { return r <= 3.0; });
  std::printf("| %s | %zu | %.1f | %.1f | %.2f | %.1f |\n", name.c_str(), ratios.size(), median(errors),
              median(sigmas), median(ratios),
              100.0 * static_cast<double>(within) / static_cast<double>(ratios.size()));
}

void print_table(const char* title, const std::vector<std::string>& scenes, const std::vector<World>& worlds,
                 const SigmaFactors& factors) {
  std::printf(
      "\n%s\n\n| scene | keyframes | error, median (mm) | sigma, "
      "median (mm) | error / sigma, median | "
      "within 3 sigma (%%) |\n|---|---|---|---|---|---|\n",
      title);
  for (const std::string& scene : scenes) print_row(scene, worlds, factors);
  print_row("all", worlds, factors);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Fits the factors of standard deviations to generated worlds");
  std::vector<std::string> scenes;
  std::pair<int, int> fit{1, 5}, check{6, 15};
  int frames = 150;
  int threads = 1;
  app.add_option("--scene", scenes, "room, office, structure unless told otherwise");
  app.add_option("--frames", frames, "Of each world")->check(CLI::PositiveNumber);
  app.add_option("--fit", fit, "First and last seed of the worlds that the factors are fitted to");
  app.add_option("--check", check, "Of those that they are checked on");
  app.add_option("--threads", threads, "Worlds side by side")->check(CLI::Range(1, 256));
  CLI11_PARSE(app, argc, argv);
  if (scenes.empty()) scenes = {"room", "office", "structure"};
  cv::setNumThreads(1);
  const core::Executor executor(threads);
  const auto worlds_of = [&](std::pair<int, int> seeds) {
    std::vector<std::pair<std::string, int>> wanted;
    for (const std::string& scene : scenes) {
      for (int seed = seeds.first; seed <= seeds.second; ++seed) wanted.emplace_back(scene, seed);
    }
    std::vector<World> worlds(wanted.size());
    executor.parallel_for(wanted.size(), [&](std::size_t i) {
      auto world = mapped(wanted[i].first, wanted[i].second, frames);
      if (!world) throw std::runtime_error(world.error().message);
      worlds[i] = std::move(*world);
    });
    return worlds;
  };
  try {
    const std::vector<World> known = worlds_of(fit);
    const SigmaFactors factors = fitted(known, executor);
    std::printf("factors: points %.2f, lines %.2f, edges %.2f\n", factors.points, factors.lines,
                factors.edges);
    print_table("At their word, worlds of the fit:", scenes, known, {1.0, 1.0, 1.0});
    print_table("With these factors, worlds of the fit:", scenes, known, factors);
    const std::vector<World> others = worlds_of(check);
    print_table("With these factors, other worlds:", scenes, others, factors);
    print_table("With the program's factors, other worlds:", scenes, others,
                mapping::GlobalAdjustmentOptions().sigma_factors);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "sigma_factors: %s\n", error.what());
    return 1;
  }
  return 0;
}
