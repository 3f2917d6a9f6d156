// SPDX-License-Identifier: BSD-3-Clause
// Bundle adjustment by our own solver, by Ceres, and by Ceres with derivatives that it finds by itself, the
// same problems and the same ends of iterations: keyframes on a path of laps that see points and lines around
// them. Prints a table; numbers of docs/notes.
//   compare_bundle [KEYFRAMES...]
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>

#include "../unit/ceres_bundle.hpp"
#include "../unit/random_world.hpp"
#include "plumbline/optimize/bundle_adjustment.hpp"

namespace plumbline {
namespace {

using geometry::Rigid3;
using tests::Random;

const sensor::Pinhole kCamera{640, 480, 525.0, 525.0, 319.5, 239.5};
constexpr double kRadius = 5.0;  // of the lap, metres; landmarks stand on a wall 3 m further out

Rigid3 camera_from_world(double angle) {
  Eigen::Matrix3d world_from_camera;  // z outwards, y down
  world_from_camera.col(0) << std::sin(angle), -std::cos(angle), 0.0;
  world_from_camera.col(1) << 0.0, 0.0, -1.0;
  world_from_camera.col(2) << std::cos(angle), std::sin(angle), 0.0;
  return Rigid3(world_from_camera, {kRadius * std::cos(angle), kRadius * std::sin(angle), 0.0}).inverse();
}

Eigen::Vector3d on_the_wall(Random& random) {
  const double angle = random.uniform(0.0, 2.0 * M_PI);
  const double radius = kRadius + random.uniform(2.0, 4.0);
  return {radius * std::cos(angle), radius * std::sin(angle), random.uniform(-1.2, 1.2)};
}

bool in_view(const Eigen::Vector3d& p) { return p.z() > 0.4 && kCamera.contains(kCamera.project(p)); }

/// Two laps; 42 points and 8 lines a keyframe, each seen by all that look at them.
optimize::BundleProblem make_problem(int keyframes) {
  Random random(7);
  optimize::BundleProblem problem;
  problem.camera = kCamera;
  std::vector<Rigid3> truth;
  for (int i = 0; i < keyframes; ++i) {
    truth.push_back(camera_from_world(4.0 * M_PI * i / keyframes));
    problem.poses.push_back({i == 0 ? truth.back() : random.step(0.02, 0.01) * truth.back(), i == 0});
  }
  for (int n = 0; n < 42 * keyframes; ++n) {
    const Eigen::Vector3d point = on_the_wall(random);
    const int index = static_cast<int>(problem.points.size());
    problem.points.push_back(point + random.vector(0.02));
    for (int i = 0; i < keyframes; ++i) {
      const Eigen::Vector3d p = truth[static_cast<std::size_t>(i)] * point;
      if (!in_view(p)) continue;
      optimize::BundlePointObservation seen;
      seen.pose = i;
      seen.point = index;
      seen.pixel = kCamera.project(p) + Eigen::Vector2d(random.normal(0.7), random.normal(0.7));
      seen.depth = p.z() + random.normal(0.01);
      seen.depth_sigma = 0.01;
      problem.point_observations.push_back(seen);
    }
  }
  for (int n = 0; n < 8 * keyframes; ++n) {
    const Eigen::Vector3d a = on_the_wall(random);
    const Eigen::Vector3d b = a + 0.4 * random.direction();
    const int index = static_cast<int>(problem.lines.size());
    problem.lines.push_back(geometry::line_through(a + random.vector(0.01), b + random.vector(0.01)));
    for (int i = 0; i < keyframes; ++i) {
      const Eigen::Vector3d ca = truth[static_cast<std::size_t>(i)] * a;
      const Eigen::Vector3d cb = truth[static_cast<std::size_t>(i)] * b;
      if (!in_view(ca) || !in_view(cb)) continue;
      optimize::BundleLineObservation seen;
      seen.pose = i;
      seen.line = index;
      seen.start = kCamera.project(ca) + Eigen::Vector2d(random.normal(0.3), random.normal(0.3));
      seen.end = kCamera.project(cb) + Eigen::Vector2d(random.normal(0.3), random.normal(0.3));
      seen.pixel_sigma = 0.25;
      seen.has_depth = true;
      seen.start_camera = ca + random.vector(0.01);
      seen.end_camera = cb + random.vector(0.01);
      problem.line_observations.push_back(seen);
    }
  }
  return problem;
}

/// Of the processor's time of this thread.
template <typename Work>
double milliseconds(const Work& work) {
  const auto now = [] {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
  };
  const double start = now();
  work();
  return now() - start;
}

void compare(int keyframes) {
  const optimize::BundleProblem problem = make_problem(keyframes);
  optimize::BundleOptions options;
  options.rounds = 1;
  options.max_iterations = 10;
  std::printf("| %d | %zu, %zu | %zu, %zu |", keyframes, problem.points.size(), problem.lines.size(),
              problem.point_observations.size(), problem.line_observations.size());
  for (const auto& adjust : {optimize::adjust_bundle, optimize::adjust_map_bundle}) {
    optimize::BundleProblem ours = problem;
    optimize::BundleSummary summary;
    const double ms = milliseconds([&] { summary = adjust(ours, options); });
    std::printf(" %d, %.2f | %.1f |", summary.iterations, summary.final_cost, ms);
  }
  optimize::BundleProblem theirs = problem;
  tests::CeresCosts costs;
  const double ms = milliseconds([&] { costs = tests::solve_with_ceres(theirs, options); });
  std::printf(" %d, %.2f | %.1f |\n", costs.iterations, costs.final, ms);
}

}  // namespace
}  // namespace plumbline

int main(int argc, char** argv) {
  std::printf(
      "| keyframes | points, lines | sightings | iterations, cost | ms | by Ceres: iterations, cost | ms | "
      "Ceres' own derivatives: iterations, cost | ms |\n");
  std::printf("|---|---|---|---|---|---|---|---|---|\n");
  if (argc < 2) {
    for (const int keyframes : {10, 30, 100, 300}) plumbline::compare(keyframes);
  }
  for (int i = 1; i < argc; ++i) plumbline::compare(std::max(2, std::atoi(argv[i])));
  return 0;
}
