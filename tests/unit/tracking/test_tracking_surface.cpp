// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "plumbline/sensor/depth_noise.hpp"
#include "plumbline/tracking/association.hpp"
#include "plumbline/tracking/surface_sampler.hpp"
#include "tracking_world.hpp"

namespace plumbline::tracking {
namespace {

using geometry::Rigid3;
using tests::kTestCamera;
using tests::Random;
using tests::render_depth;
using tests::WorldPlane;

double degrees_between(const Eigen::Vector3f& a, const Eigen::Vector3d& b) {
  return std::acos(std::min(1.0, a.cast<double>().dot(b))) * 57.29578;
}

void add_noise(cv::Mat& depth, std::uint32_t seed) {
  Random random(seed);
  for (int y = 0; y < depth.rows; ++y) {
    for (int x = 0; x < depth.cols; ++x) {
      float& z = depth.at<float>(y, x);
      if (z > 0.0F) z += static_cast<float>(random.normal(sensor::depth_sigma(static_cast<double>(z))));
    }
  }
}

/// A wall, a floor, and a board in front of the wall.
const std::vector<WorldPlane> kRoom{{{0.0, 0.0, 3.0}, {0.0, 0.0, -1.0}, 0.0},
                                    {{0.0, 1.0, 0.0}, {0.0, -1.0, 0.0}, 0.0},
                                    {{0.3, -0.1, 1.8}, Eigen::Vector3d(0.4, 0.0, -1.0).normalized(), 0.5}};

TEST(SampleSurface, NormalsAreExactOnACleanPlane) {
  const Eigen::Vector3d n = Eigen::Vector3d(0.5, -0.3, -0.8).normalized();
  const std::vector<WorldPlane> plane{{{0.0, 0.0, 2.5}, n, 0.0}};
  const auto samples = sample_surface(render_depth(plane, {}), kTestCamera, {});
  ASSERT_EQ(samples.size(), 1600U);
  std::vector<double> errors;
  for (const maps::SurfaceSample& s : samples) {
    errors.push_back(degrees_between(s.normal, n));
    EXPECT_NEAR(n.dot(s.point.cast<double>() - plane[0].centre), 0.0, 2e-3);
    EXPECT_NEAR(s.normal.norm(), 1.0F, 1e-5F);
    EXPECT_GT(s.sigma, 0.0F);
  }
  std::sort(errors.begin(), errors.end());
  EXPECT_LT(errors[errors.size() * 9 / 10], 0.3);
  EXPECT_LT(errors.back(), 3.5) << "smoothing is lopsided at the rim of the picture";
}

TEST(SampleSurface, NormalsSurviveTheSensorsNoise) {
  const Eigen::Vector3d n = Eigen::Vector3d(0.3, -0.2, -0.9).normalized();
  cv::Mat depth = render_depth({{{0.0, 0.0, 2.0}, n, 0.0}}, {});
  add_noise(depth, 1);
  const auto samples = sample_surface(depth, kTestCamera, {});
  ASSERT_GT(samples.size(), 1500U);
  std::vector<double> errors;
  for (const maps::SurfaceSample& s : samples) errors.push_back(degrees_between(s.normal, n));
  std::sort(errors.begin(), errors.end());
  EXPECT_LT(errors[errors.size() / 2], 4.0);
  EXPECT_LT(errors[errors.size() * 95 / 100], 10.0);
}

TEST(SampleSurface, NothingIsMixedAcrossDepthJumpsAndEdges) {
  cv::Mat face;
  const cv::Mat depth = render_depth(kRoom, {}, &face);
  const auto samples = sample_surface(depth, kTestCamera, {});
  ASSERT_GT(samples.size(), 1200U);
  int of_board = 0;
  int at_crease = 0;
  for (const maps::SurfaceSample& s : samples) {
    // Where wall and floor meet depth is continuous, and the wide base rounds the crease.
    if (s.point.z() > 2.9F && s.point.y() > 0.9F) {
      ++at_crease;
      continue;
    }
    double best = 180.0;
    double distance = 1e9;
    for (const WorldPlane& plane : kRoom) {
      const double angle = degrees_between(s.normal, plane.normal);
      if (angle < best) {
        best = angle;
        distance = std::abs(plane.normal.dot(s.point.cast<double>() - plane.centre));
      }
    }
    EXPECT_LT(best, 5.0) << s.point.transpose();
    EXPECT_LT(distance, 0.01) << "the normal belongs to another plane than the point";
    of_board += s.point.z() < 2.4F && s.point.y() < 0.9F ? 1 : 0;
    EXPECT_GT(-s.normal.dot(s.point.normalized()), 0.0F) << "towards the camera";
  }
  EXPECT_GT(of_board, 200);
  EXPECT_LT(at_crease, static_cast<int>(samples.size()) / 6);
}

TEST(SampleSurface, HalfOfTheSamplesGoToRareDirections) {
  // The board is small: spread over the picture alone it would get its share of the area, about 4 %.
  std::vector<WorldPlane> room{kRoom[0],
                               {{0.0, 0.0, 2.0}, Eigen::Vector3d(0.8, 0.0, -1.0).normalized(), 0.2}};
  cv::Mat face;
  const cv::Mat depth = render_depth(room, {}, &face);
  const double area = cv::countNonZero(face == 1) / (640.0 * 480.0);
  ASSERT_LT(area, 0.06);
  ASSERT_GT(area, 0.005);
  int rare = 0;
  const auto samples = sample_surface(depth, kTestCamera, {});
  for (const maps::SurfaceSample& s : samples)
    rare += degrees_between(s.normal, room[1].normal) < 10.0 ? 1 : 0;
  EXPECT_GT(rare, 3.0 * area * static_cast<double>(samples.size()));
}

TEST(SampleSurface, RangesAndIncidenceAreHonoured) {
  SurfaceSamplerOptions options;
  options.samples = 400;
  const cv::Mat depth = render_depth(kRoom, {});
  EXPECT_EQ(sample_surface(depth, kTestCamera, options).size(), 400U);
  options.max_depth_m = 2.2;
  options.min_depth_m = 1.9;
  for (const auto& s : sample_surface(depth, kTestCamera, options)) {
    EXPECT_LE(s.point.z(), 2.2F);
    EXPECT_GE(s.point.z(), 1.9F);
  }
  options = {};
  options.max_incidence_rad = 0.5;
  const auto frontal = sample_surface(depth, kTestCamera, options);
  ASSERT_FALSE(frontal.empty());
  for (const auto& s : frontal) EXPECT_GT(-s.normal.dot(s.point.normalized()), std::cos(0.5) - 1e-4);
}

TEST(SampleSurface, BadDepthGivesNoSamples) {
  EXPECT_TRUE(sample_surface({}, kTestCamera, {}).empty());
  for (const float bad :
       {0.0F, std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), -1.0F}) {
    EXPECT_TRUE(
        sample_surface(cv::Mat(480, 640, CV_32FC1, cv::Scalar(static_cast<double>(bad))), kTestCamera, {})
            .empty())
        << bad;
  }
  EXPECT_TRUE(sample_surface(cv::Mat(4, 4, CV_32FC1, cv::Scalar(2)), kTestCamera, {}).empty());
  // NaN here and there only costs the places around it.
  cv::Mat depth = render_depth(kRoom, {});
  for (int y = 0; y < 480; y += 40) depth.row(y).setTo(std::numeric_limits<float>::quiet_NaN());
  const auto samples = sample_surface(depth, kTestCamera, {});
  EXPECT_GT(samples.size(), 500U);
  for (const auto& s : samples) {
    EXPECT_TRUE(s.point.allFinite());
    EXPECT_TRUE(s.normal.allFinite());
  }
}

TEST(SampleSurface, SameBytesTwice) {
  const cv::Mat depth = render_depth(kRoom, {});
  const auto a = sample_surface(depth, kTestCamera, {});
  const auto b = sample_surface(depth, kTestCamera, {});
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].point, b[i].point);
    EXPECT_EQ(a[i].normal, b[i].normal);
  }
}

/// Samples of the wall at z = 2 of the world.
std::vector<WorldSurface> wall_samples() {
  std::vector<WorldSurface> result;
  for (double y = -0.6; y <= 0.6; y += 0.1) {
    for (double x = -0.8; x <= 0.8; x += 0.1) result.push_back({{x, y, 2.0}, {0.0, 0.0, -1.0}, 0.005});
  }
  return result;
}
const std::vector<WorldPlane> kWall{{{0.0, 0.0, 2.0}, {0.0, 0.0, -1.0}, 0.0}};

TEST(AssociateSurface, IsExactAtTheTruePose) {
  Random random(1);
  for (int i = 0; i < 5; ++i) {
    const Rigid3 pose = random.step(0.2, 0.15);
    const auto surface = wall_samples();
    const auto terms = associate_surface(surface, {render_depth(kWall, pose), kTestCamera, pose, {}}, {});
    ASSERT_GT(terms.size(), surface.size() * 8 / 10);
    for (const optimize::PlaneTerm& term : terms) {
      EXPECT_NEAR(optimize::plane_residual(term, pose, nullptr) * term.sigma, 0.0, 1e-4);
      EXPECT_GE(term.sigma, 0.005);
    }
  }
}

TEST(AssociateSurface, ResidualsTellHowFarThePoseIsOff) {
  const cv::Mat depth = render_depth(kWall, {});
  const Rigid3 guess(Eigen::Matrix3d::Identity(),
                     {0.0, 0.0, -0.03});  // believes to be 3 cm nearer to the wall
  const auto terms = associate_surface(wall_samples(), {depth, kTestCamera, guess, {}}, {});
  ASSERT_GT(terms.size(), 150U);
  for (const auto& term : terms) {
    EXPECT_NEAR(std::abs(optimize::plane_residual(term, guess, nullptr)) * term.sigma, 0.03, 1e-4);
    EXPECT_NEAR(optimize::plane_residual(term, {}, nullptr), 0.0, 0.05);
  }
}

TEST(AssociateSurface, DepthStampedApartIsBroughtBack) {
  const Rigid3 pose(geometry::exp_so3({0.02, 0.05, 0.0}), {0.1, 0.0, 0.05});
  const Rigid3 depth_from_camera(geometry::exp_so3({0.0, 0.03, 0.01}), {0.02, 0.01, 0.03});
  const cv::Mat depth = render_depth(kWall, depth_from_camera * pose);
  for (const auto& term :
       associate_surface(wall_samples(), {depth, kTestCamera, pose, depth_from_camera}, {})) {
    EXPECT_NEAR(optimize::plane_residual(term, pose, nullptr) * term.sigma, 0.0, 2e-4);
  }
  double worst = 0.0;
  for (const auto& term : associate_surface(wall_samples(), {depth, kTestCamera, pose, {}}, {})) {
    worst = std::max(worst, std::abs(optimize::plane_residual(term, pose, nullptr)) * term.sigma);
  }
  EXPECT_GT(worst, 0.02) << "without it the difference shows";
}

TEST(AssociateSurface, Gates) {
  const cv::Mat depth = render_depth(kWall, {});
  SurfaceAssociationOptions options;
  const auto count = [&](const WorldSurface& s, const cv::Mat& d) {
    return associate_surface({s}, {d, kTestCamera, {}, {}}, options).size();
  };
  const WorldSurface good{{0.1, 0.1, 2.0}, {0.0, 0.0, -1.0}, 0.005};
  EXPECT_EQ(count(good, depth), 1U);
  EXPECT_EQ(count({{0.1, 0.1, 2.15}, {0.0, 0.0, -1.0}, 0.005}, depth), 0U) << "too far from its plane";
  EXPECT_EQ(count({{0.1, 0.1, 2.0}, {0.0, 0.0, 1.0}, 0.005}, depth), 0U) << "turned away";
  EXPECT_EQ(count({{0.1, 0.1, 2.0}, {1.0, 0.0, -0.1}, 0.005}, depth), 0U) << "seen along its plane";
  EXPECT_EQ(count({{0.1, 0.1, -2.0}, {0.0, 0.0, 1.0}, 0.005}, depth), 0U) << "behind the camera";
  EXPECT_EQ(count({{5.0, 0.1, 2.0}, {0.0, 0.0, -1.0}, 0.005}, depth), 0U) << "out of the picture";
  EXPECT_EQ(count(good, {}), 0U);
  EXPECT_EQ(count(good, cv::Mat(480, 640, CV_32FC1, cv::Scalar(0))), 0U);
  EXPECT_EQ(count(good, cv::Mat(480, 640, CV_32FC1, cv::Scalar(std::numeric_limits<double>::quiet_NaN()))),
            0U);
  options.max_depth_m = 1.9;
  EXPECT_EQ(count(good, depth), 0U) << "too deep";
  options = {};
  options.max_samples = 50;
  EXPECT_LE(associate_surface(wall_samples(), {depth, kTestCamera, {}, {}}, options).size(), 50U);
  EXPECT_GT(associate_surface(wall_samples(), {depth, kTestCamera, {}, {}}, options).size(), 30U);
  EXPECT_TRUE(associate_surface({}, {depth, kTestCamera, {}, {}}, options).empty());
}

TEST(AssociateSurface, TakesNothingOverADepthJump) {
  const std::vector<WorldPlane> step{kWall[0],
                                     {{-1.0, 0.0, 1.95}, {0.0, 0.0, -1.0}, 1.0}};  // a step of 5 cm at x = 0
  const cv::Mat depth = render_depth(step, {});
  std::vector<WorldSurface> across;
  for (int i = -20; i <= 20; ++i) across.push_back({{1e-4 * i, 0.0, 2.0}, {0.0, 0.0, -1.0}, 0.005});
  for (const auto& term : associate_surface(across, {depth, kTestCamera, {}, {}}, {})) {
    EXPECT_TRUE(std::abs(term.camera.z() - 2.0) < 1e-4 || std::abs(term.camera.z() - 1.95) < 1e-4)
        << term.camera.z();
  }
}

}  // namespace
}  // namespace plumbline::tracking
