// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Keyframes around points and lines of known truth, and how far a bundle is from it.
#include <cmath>

#include "plumbline/optimize/bundle_adjustment.hpp"
#include "random_world.hpp"

namespace plumbline::optimize {

using geometry::Rigid3;
using tests::Random;

inline const sensor::Pinhole kCamera{640, 480, 525.0, 525.0, 319.5, 239.5};

struct Scenario {
  int keyframes = 20;
  int points = 2000;
  int lines = 200;
  double pixel_noise = 0.0;
  double depth_noise = 0.0;
  int wrong_every = 0;        ///< every n-th observation is wrong; 0: none
  double pose_error_m = 0.0;  ///< of the start
  double pose_error_rad = 0.0;
  double landmark_error_m = 0.0;
  std::uint32_t seed = 1;
};

struct World {
  BundleProblem problem;
  BundleProblem truth;
};

inline bool visible(const Eigen::Vector3d& p) { return p.z() > 0.4 && kCamera.contains(kCamera.project(p)); }

inline void see_point(const Scenario& s, Random& random, BundleProblem& problem, int pose, int point) {
  const Eigen::Vector3d p = problem.poses[static_cast<std::size_t>(pose)].camera_from_world *
                            problem.points[static_cast<std::size_t>(point)];
  if (!visible(p)) return;
  BundlePointObservation o;
  o.pose = pose;
  o.point = point;
  o.pixel = kCamera.project(p) + s.pixel_noise * Eigen::Vector2d(random.normal(), random.normal());
  o.pixel_sigma = std::max(0.5, s.pixel_noise);
  o.depth = p.z() + random.normal(s.depth_noise);
  o.depth_sigma = std::max(0.01, s.depth_noise);
  const std::size_t count = problem.point_observations.size();
  if (s.wrong_every > 0 && count % static_cast<std::size_t>(s.wrong_every) == 0) {
    o.pixel += Eigen::Vector2d(random.uniform(20, 60), random.uniform(-60, -20));
  }
  problem.point_observations.push_back(o);
}

inline void see_line(const Scenario& s, Random& random, BundleProblem& problem, int pose, int line,
                     const std::pair<Eigen::Vector3d, Eigen::Vector3d>& ends) {
  const Rigid3& camera_from_world = problem.poses[static_cast<std::size_t>(pose)].camera_from_world;
  const Eigen::Vector3d a = camera_from_world * ends.first;
  const Eigen::Vector3d b = camera_from_world * ends.second;
  if (!visible(a) || !visible(b)) return;
  BundleLineObservation o;
  o.pose = pose;
  o.line = line;
  o.start = kCamera.project(a) + s.pixel_noise * Eigen::Vector2d(random.normal(), random.normal());
  o.end = kCamera.project(b) + s.pixel_noise * Eigen::Vector2d(random.normal(), random.normal());
  o.pixel_sigma = std::max(0.5, s.pixel_noise);
  o.has_depth = true;
  o.start_camera = kCamera.unproject(o.start.x(), o.start.y(), a.z() + random.normal(s.depth_noise));
  o.end_camera = kCamera.unproject(o.end.x(), o.end.y(), b.z() + random.normal(s.depth_noise));
  o.start_sigma = o.end_sigma = std::max(0.01, s.depth_noise);
  if (s.wrong_every > 0 && problem.line_observations.size() % static_cast<std::size_t>(s.wrong_every) == 0) {
    o.start += Eigen::Vector2d(30.0, 40.0);
    o.has_depth = false;
  }
  problem.line_observations.push_back(o);
}

/// Cameras on an arc that look at a cloud of points and segments; the first pose is held.
inline World make_world(const Scenario& s) {
  Random random(s.seed);
  World world;
  BundleProblem& truth = world.truth;
  truth.camera = kCamera;
  for (int i = 0; i < s.keyframes; ++i) {
    const double phi = 0.05 * (i - 0.5 * s.keyframes);
    const Rigid3 world_from_camera(geometry::exp_so3({0.05 * std::sin(0.9 * i), phi, 0.02 * i}),
                                   {-2.5 * phi, 0.2 * std::sin(0.5 * i), 0.1 * std::cos(0.7 * i)});
    truth.poses.push_back({world_from_camera.inverse(), i == 0});
  }
  for (int i = 0; i < s.points; ++i) {
    truth.points.emplace_back(random.uniform(-2, 2), random.uniform(-1.4, 1.4), random.uniform(1.8, 4.0));
  }
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> ends;
  for (int i = 0; i < s.lines; ++i) {
    const Eigen::Vector3d a(random.uniform(-1.5, 1.5), random.uniform(-1, 1), random.uniform(1.8, 4.0));
    const Eigen::Vector3d b = a + random.uniform(0.4, 1.0) * random.direction();
    ends.emplace_back(a, b);
    truth.lines.push_back(geometry::line_through(a, b));
  }
  for (int k = 0; k < s.keyframes; ++k) {
    for (int i = 0; i < s.points; ++i) see_point(s, random, truth, k, i);
    for (int i = 0; i < s.lines; ++i) see_line(s, random, truth, k, i, ends[static_cast<std::size_t>(i)]);
  }
  world.problem = truth;
  for (BundlePose& pose : world.problem.poses) {
    if (!pose.fixed) {
      pose.camera_from_world = random.step(s.pose_error_m, s.pose_error_rad) * pose.camera_from_world;
    }
  }
  for (Eigen::Vector3d& p : world.problem.points) p += random.vector(s.landmark_error_m);
  for (std::size_t i = 0; i < ends.size(); ++i) {
    world.problem.lines[i] = geometry::line_through(ends[i].first + random.vector(s.landmark_error_m),
                                                    ends[i].second + random.vector(s.landmark_error_m));
  }
  return world;
}

struct Error {
  double metres = 0.0;  ///< RMS over the poses
  double degrees = 0.0;
};
inline Error error_of(const BundleProblem& found, const BundleProblem& truth) {
  Error e;
  for (std::size_t i = 0; i < found.poses.size(); ++i) {
    const double d = tests::distance(found.poses[i].camera_from_world, truth.poses[i].camera_from_world);
    const double a =
        tests::angle(found.poses[i].camera_from_world, truth.poses[i].camera_from_world) * 57.29578;
    e.metres += d * d;
    e.degrees += a * a;
  }
  const auto n = static_cast<double>(found.poses.size());
  return {std::sqrt(e.metres / n), std::sqrt(e.degrees / n)};
}

inline bool finite(const BundleProblem& problem) {
  for (const BundlePose& pose : problem.poses) {
    if (!pose.camera_from_world.translation.allFinite() || !pose.camera_from_world.rotation.allFinite())
      return false;
  }
  for (const auto& p : problem.points) {
    if (!p.allFinite()) return false;
  }
  for (const auto& l : problem.lines) {
    if (!l.n.allFinite() || !l.v.allFinite()) return false;
  }
  return true;
}

inline Scenario noisy() {
  Scenario s;
  s.pixel_noise = 0.7;
  s.depth_noise = 0.01;
  s.wrong_every = 10;
  s.pose_error_m = 0.05;
  s.pose_error_rad = 0.03;
  s.landmark_error_m = 0.03;
  return s;
}

}  // namespace plumbline::optimize
