// SPDX-License-Identifier: BSD-3-Clause
// Direct alignment on a wall with faint grain under noise, tilted, two metres away.
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <random>

#include "plumbline/optimize/pose_solver.hpp"
#include "plumbline/sensor/depth_noise.hpp"
#include "plumbline/tracking/photometric_alignment.hpp"

namespace plumbline {
namespace {

using geometry::Rigid3;
using geometry::Vector6d;

const sensor::Pinhole kCamera{640, 480, 525.0, 525.0, 319.5, 239.5};
const Eigen::Vector3d kNormal = Eigen::Vector3d(0.2, -0.1, -1.0).normalized();
constexpr double kDistance = 2.0;  // of the wall from the world's origin, metres

struct Wave {
  Eigen::Vector2d k;
  double phase;
};
constexpr unsigned kSmooth = 9;  // a wall whose grain is wide
std::vector<Wave> grain(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> angle(0.0, 6.283);
  // Metres: 3 to 10 pixels, or 12 to 25.
  std::uniform_real_distribution<double> length(seed == kSmooth ? 0.045 : 0.012,
                                                seed == kSmooth ? 0.095 : 0.04);
  std::vector<Wave> waves;
  for (int i = 0; i < 16; ++i) {
    const double a = angle(random), k = 6.283 / length(random);
    waves.push_back({{k * std::cos(a), k * std::sin(a)}, angle(random)});
  }
  return waves;
}

struct PlaneLook {
  cv::Mat1b gray = cv::Mat1b(480, 640);
  cv::Mat1f depth = cv::Mat1f(480, 640);
};
/// `amplitude`: of the grain, grey values; noise has a standard deviation of 1.
PlaneLook look(const Rigid3& camera_from_world, double amplitude, unsigned noise_seed, double exposure = 1.0,
               unsigned grain_seed = 7) {
  static const std::vector<Wave> wall = grain(7), other = grain(8), smooth = grain(kSmooth);
  const std::vector<Wave>& waves = grain_seed == 7 ? wall : grain_seed == kSmooth ? smooth : other;
  const Rigid3 world_from_camera = camera_from_world.inverse();
  std::mt19937 random(noise_seed);
  std::normal_distribution<double> noise(0.0, 1.0);
  PlaneLook result;
  for (int y = 0; y < 480; ++y) {
    for (int x = 0; x < 640; ++x) {
      const Eigen::Vector3d ray = world_from_camera.rotation * kCamera.unproject(x, y, 1.0);
      const double z =
          (-kDistance - kNormal.dot(world_from_camera.translation)) / kNormal.dot(ray);  // n p = -d
      const Eigen::Vector3d p = world_from_camera.translation + z * ray;
      double value = 0.0;
      for (const Wave& w : waves) value += std::sin(w.k.dot(p.head<2>()) + w.phase);
      const double shade = 130.0 + 20.0 * x / 640.0;  // the lens, not the wall
      result.gray(y, x) = cv::saturate_cast<std::uint8_t>(
          exposure * (shade + amplitude * value / std::sqrt(8.0)) + noise(random));
      result.depth(y, x) = static_cast<float>(z);
    }
  }
  return result;
}

Rigid3 moved(double x, double y, double z, double rx, double ry, double rz) {
  return geometry::exp_se3((Vector6d() << x, y, z, rx, ry, rz).finished());
}
const Rigid3 kTruth = moved(0.03, -0.02, 0.01, 0.01, 0.015, -0.02);

struct Pair {
  features::PhotometricSamples samples;
  features::PhotometricImage image;
  PlaneLook second;
  [[nodiscard]] tracking::PhotometricView view() const { return {&image, &second.depth, {}, kCamera}; }
};
Pair make_pair(const Rigid3& second_pose, double amplitude, double exposure = 1.0,
               unsigned second_grain = 7) {
  const PlaneLook first = look({}, amplitude, 1, 1.0, second_grain == kSmooth ? kSmooth : 7);
  Pair pair;
  pair.second = look(second_pose, amplitude, 2, exposure, second_grain);
  pair.samples =
      features::sample_photometric(features::make_photometric_image(first.gray), first.depth, kCamera, {});
  pair.image = features::make_photometric_image(pair.second.gray);
  return pair;
}

/// Solved from `start` as the tracker does: grey values, and the wall as planes.
Rigid3 solve(const Pair& pair, const Rigid3& start) {
  Rigid3 pose = start;
  for (const std::size_t level : {1U, 0U, 0U}) {
    optimize::PoseProblem problem;
    problem.camera = kCamera;
    auto family = tracking::associate_photometric(pair.samples, level, pair.view(), {}, pose);
    EXPECT_TRUE(family.has_value());
    if (!family) return pose;
    problem.photometric = std::move(family);
    for (int y = 20; y < 480; y += 40) {
      for (int x = 20; x < 640; x += 40) {
        const double z = static_cast<double>(pair.second.depth(y, x));
        problem.planes.push_back({kCamera.unproject(x, y, z), -kDistance * kNormal, kNormal, 0.005});
      }
    }
    pose = optimize::solve_pose(problem, pose, {}).camera_from_world;
  }
  return pose;
}

double error_m(const Rigid3& pose) { return (pose * kTruth.inverse()).inverse().translation.norm(); }

TEST(Photometric, GradientIsThatOfTheCost) {
  const Pair pair = make_pair(kTruth, 20.0, 1.0, kSmooth);
  const Rigid3 pose = moved(0.0004, -0.0003, 0.0005, 0.0002, -0.0001, 0.0003) * kTruth;
  auto family = tracking::associate_photometric(pair.samples, 0, pair.view(), {}, pose);
  ASSERT_TRUE(family);
  const auto sums = optimize::sum_photometric(*family, pose, 1e6);
  // Near the solution the reference's gradient is that of the picture.
  constexpr double kStep = 2e-4;
  for (int i = 0; i < 6; ++i) {
    Vector6d xi = Vector6d::Zero();
    xi(i) = kStep;
    const double up = optimize::sum_photometric(*family, geometry::exp_se3(xi) * pose, 1e6).cost;
    const double down = optimize::sum_photometric(*family, geometry::exp_se3(-xi) * pose, 1e6).cost;
    const double expected = (up - down) / (2.0 * kStep);
    EXPECT_NEAR(sums.g(i), expected, 0.25 * std::abs(expected) + 0.05 * sums.g.norm()) << i;
  }
}

TEST(Photometric, FaintGrainHoldsTheCameraBeforeABareWall) {
  const Pair pair = make_pair(kTruth, 2.0);
  const Rigid3 start = moved(0.006, -0.005, 0.0, 0.0, 0.001, 0.002) * kTruth;
  EXPECT_GT(error_m(start), 0.005);
  EXPECT_LT(error_m(solve(pair, start)), 0.001);
}

TEST(Photometric, ExposureAndShadingOfTheLensDoNotMatter) {
  const Pair pair = make_pair(kTruth, 6.0, 0.6);
  const Rigid3 start = moved(0.004, 0.004, 0.0, 0.0, 0.0, 0.002) * kTruth;
  EXPECT_LT(error_m(solve(pair, start)), 0.001);
  const auto family = tracking::associate_photometric(pair.samples, 0, pair.view(), {}, kTruth);
  ASSERT_TRUE(family);
  EXPECT_NEAR(family->gain, 0.6, 0.1);
}

TEST(Photometric, WhatDoesNotShowTheSameDoesNotAgree) {
  const auto agrees = [](const Pair& pair) {
    const auto family = tracking::associate_photometric(pair.samples, 0, pair.view(), {}, kTruth);
    return family && tracking::photometric_agrees(*family, kTruth);
  };
  EXPECT_TRUE(agrees(make_pair(kTruth, 2.0)));
  EXPECT_FALSE(agrees(make_pair(kTruth, 2.0, 1.0, 8)));  // another wall
  EXPECT_FALSE(agrees(make_pair(kTruth, 0.0)));          // nothing but noise
}

TEST(Photometric, LooksToTheSideForTheBestFit) {
  const Pair pair = make_pair(kTruth, 10.0);
  const Rigid3 start = moved(4.0 * 2.0 / 131.25, -3.0 * 2.0 / 131.25, 0.0, 0.0, 0.0, 0.0) * kTruth;  // pixels
  const auto family = tracking::associate_photometric(pair.samples, 1, pair.view(), {}, start);
  ASSERT_TRUE(family);
  const tracking::ShiftedPose found = tracking::search_shift(*family, start);
  EXPECT_GT(found.correlation, 0.5);
  EXPECT_LT(error_m(found.camera_from_world), 0.012);
  EXPECT_LT(optimize::photometric_correlation(*family, start, 500), 0.3);
}

TEST(Photometric, AGuessThatNothingIsKnownOfGivesWayToAGoodOneOnly) {
  using tracking::best_hypothesis;
  EXPECT_EQ(best_hypothesis({std::nullopt, std::nullopt, 0.4}), 0U);  // where the camera was: a look-alike
  EXPECT_EQ(best_hypothesis({std::nullopt, std::nullopt, 0.9}), 2U);
  EXPECT_EQ(best_hypothesis({std::nullopt, 0.85, 0.95}), 2U);
  EXPECT_EQ(best_hypothesis({0.5, 0.6, std::nullopt}), 1U);
  EXPECT_EQ(best_hypothesis({0.5, 0.53, 0.52}), 0U);  // no better to speak of
  EXPECT_EQ(best_hypothesis({-0.1, 0.0}), 1U);
  EXPECT_EQ(best_hypothesis({std::nullopt}), 0U);
}

TEST(Photometric, WhatStandsBeforeTheWallHidesIt) {
  Pair pair = make_pair(kTruth, 10.0);
  const auto all = tracking::associate_photometric(pair.samples, 0, pair.view(), {}, kTruth);
  pair.second.depth.colRange(0, 320).setTo(1.0F);
  const auto half = tracking::associate_photometric(pair.samples, 0, pair.view(), {}, kTruth);
  ASSERT_TRUE(all && half);
  EXPECT_NEAR(static_cast<double>(half->terms.size()), 0.5 * static_cast<double>(all->terms.size()),
              0.05 * static_cast<double>(all->terms.size()));
}

TEST(Photometric, SteepEdgesWeighLessWhereTheCameraHasMoved) {
  const Pair pair = make_pair(kTruth, 20.0);
  const auto still = tracking::associate_photometric(pair.samples, 0, pair.view(), {}, {});
  const auto far =
      tracking::associate_photometric(pair.samples, 0, pair.view(), {}, moved(0.3, 0, 0, 0, 0, 0));
  ASSERT_TRUE(still && far);
  const auto least = [](const optimize::PhotometricFamily& f) {
    float w = 1.0F;
    for (const auto& term : f.terms) w = std::min(w, term.weight);
    return w;
  };
  EXPECT_GT(least(*still), 0.99F);
  EXPECT_LT(least(*far), 0.9F);
}

TEST(Photometric, SamplesLeaveOutJumpsAndMissingDepth) {
  PlaneLook first = look({}, 10.0, 1);
  first.depth.colRange(0, 200).setTo(1.0F);
  first.depth.colRange(400, 640).setTo(0.0F);
  const auto samples =
      features::sample_photometric(features::make_photometric_image(first.gray), first.depth, kCamera, {});
  ASSERT_FALSE(samples[0].empty());
  for (const features::PhotometricSample& s : samples[0]) {
    const double u = kCamera.project(s.point.cast<double>()).x();
    // The local mean of what lies within 13 pixels of a border holds grey values from beyond.
    EXPECT_LT(u, 387.5);
    EXPECT_GT(std::abs(u - 199.5), 11.5);
  }
  EXPECT_TRUE(
      features::sample_photometric(features::make_photometric_image(first.gray), {}, kCamera, {})[0].empty());
}

TEST(Photometric, SamplesLeaveOutBordersTooLowForOnePixelToTell) {
  PlaneLook first = look({}, 10.0, 1);
  std::mt19937 random(5);
  std::normal_distribution<float> noise(0.0F, 1.0F);
  for (float& z : first.depth) {
    z += 0.8F * noise(random) * static_cast<float>(sensor::depth_sigma(static_cast<double>(z)));
  }
  first.depth.colRange(320, 640) -= 0.1F;
  const auto samples =
      features::sample_photometric(features::make_photometric_image(first.gray), first.depth, kCamera, {});
  int left = 0;
  for (const features::PhotometricSample& s : samples[0]) {
    const double u = kCamera.project(s.point.cast<double>()).x();
    EXPECT_GT(std::abs(u - 319.5), 2.0);
    if (u < 310.0) ++left;
  }
  EXPECT_GT(left, 2000) << "noise is no border";
}

TEST(Photometric, KeyframesAreForgottenWhenThereAreMany) {
  tracking::PhotometricKeyframes keyframes;
  const auto samples = std::make_shared<const features::PhotometricSamples>();
  for (int i = 0; i < 100; ++i) keyframes.add({0, i}, samples);
  EXPECT_EQ(keyframes.find({0, 0}), nullptr);
  EXPECT_EQ(keyframes.find({1, 99}), nullptr);
  EXPECT_EQ(keyframes.find({0, 99}), samples);
}

}  // namespace
}  // namespace plumbline
