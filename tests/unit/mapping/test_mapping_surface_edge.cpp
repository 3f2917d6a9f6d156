// SPDX-License-Identifier: BSD-3-Clause
// Surface edges between two views of planes that are known exactly.
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <random>
#include <vector>

#include "plumbline/mapping/local_mapping/local_mapper.hpp"
#include "plumbline/mapping/registration/surface_edge.hpp"
#include "plumbline/sensor/depth_noise.hpp"
#include "plumbline/tracking/surface_sampler.hpp"

namespace plumbline::mapping {
namespace {

using geometry::Rigid3;

const sensor::Pinhole kSurfaceCamera{320, 240, 260.0, 260.0, 159.5, 119.5};

struct Wall {
  Eigen::Vector3d normal;  ///< towards the cameras, in the first camera's frame
  double distance;         ///< n.p
};
const std::vector<Wall> kCorner{{Eigen::Vector3d(0.0, 0.0, -1.0), -2.5},
                                {Eigen::Vector3d(0.0, -1.0, 0.0), -0.7},
                                {Eigen::Vector3d(-1.0, 0.0, 0.0), -0.9}};
const std::vector<Wall> kOneWall{{Eigen::Vector3d(0.0, 0.0, -1.0), -2.0}};

/// Depth image of the walls' inner sides, with noise.
cv::Mat look(const std::vector<Wall>& walls, const Rigid3& camera_from_first, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise;
  cv::Mat depth(kSurfaceCamera.height, kSurfaceCamera.width, CV_32FC1);
  for (int v = 0; v < depth.rows; ++v) {
    for (int u = 0; u < depth.cols; ++u) {
      double nearest = 1e9;
      for (const Wall& wall : walls) {
        const Eigen::Vector3d n = camera_from_first.rotation * wall.normal;
        const double z = (wall.distance + n.dot(camera_from_first.translation)) /
                         n.dot(kSurfaceCamera.unproject(u, v, 1.0));
        if (z > 0.0) nearest = std::min(nearest, z);
      }
      const double z = nearest + sensor::depth_sigma(nearest) * noise(random);
      depth.at<float>(v, u) = nearest < 1e8 ? static_cast<float>(z) : 0.0F;
    }
  }
  return depth;
}

/// Picture of kOneWall, which has a grain of a hand's width and is painted over by `seed`; with noise.
cv::Mat picture(const Rigid3& camera_from_first, unsigned paint = 5) {
  struct Wave {
    Eigen::Vector2d k;
    double phase;
  };
  std::mt19937 random(paint);
  std::uniform_real_distribution<double> angle(0.0, 6.283), length(0.06, 0.15);
  std::vector<Wave> waves;
  for (int i = 0; i < 12; ++i) {
    const double a = angle(random), k = 6.283 / length(random);
    waves.push_back({{k * std::cos(a), k * std::sin(a)}, angle(random)});
  }
  std::normal_distribution<double> noise;
  const Rigid3 first_from_camera = camera_from_first.inverse();
  cv::Mat gray(kSurfaceCamera.height, kSurfaceCamera.width, CV_8UC1);
  for (int v = 0; v < gray.rows; ++v) {
    for (int u = 0; u < gray.cols; ++u) {
      const Eigen::Vector3d ray = first_from_camera.rotation * kSurfaceCamera.unproject(u, v, 1.0);
      const Eigen::Vector3d p =
          first_from_camera.translation + ray * ((2.0 - first_from_camera.translation.z()) / ray.z());
      double value = 128.0;
      for (const Wave& w : waves) value += 4.0 * std::sin(w.k.dot(p.head<2>()) + w.phase);
      gray.at<std::uint8_t>(v, u) = cv::saturate_cast<std::uint8_t>(value + noise(random));
    }
  }
  return gray;
}

maps::Keyframe first_view(const std::vector<Wall>& walls) {
  maps::Keyframe keyframe;
  keyframe.id = {0, 0};
  keyframe.surface = tracking::sample_surface(look(walls, {}, 1), kSurfaceCamera, {});
  return keyframe;
}

double metres_apart(const Rigid3& a, const Rigid3& b) {
  return (a.inverse().translation - b.inverse().translation).norm();
}

const Rigid3 kTruth(geometry::exp_so3({0.02, -0.05, 0.01}), Eigen::Vector3d(0.06, -0.03, 0.05));
const Rigid3 kOff(geometry::exp_so3({0.004, 0.004, -0.004}), Eigen::Vector3d(0.008, -0.008, 0.008));

TEST(SurfaceEdge, ThreeWallsHoldAllDirections) {
  const auto edge = align_surface_edge(first_view(kCorner), {0, 1}, look(kCorner, kTruth, 2), kOff * kTruth,
                                       {}, kSurfaceCamera, {});
  ASSERT_TRUE(edge.has_value());
  EXPECT_EQ(edge->a, (core::KeyframeId{0, 0}));
  EXPECT_EQ(edge->b, (core::KeyframeId{0, 1}));
  EXPECT_LT(metres_apart(edge->b_from_a, kTruth), 0.0015) << "the hold at 1 cm does not pull it back";
  EXPECT_LT(geometry::rotation_angle(edge->b_from_a.rotation * kTruth.rotation.transpose()), 0.001);
  const geometry::Vector6d error = geometry::log_se3(kTruth * edge->b_from_a.inverse());
  EXPECT_LT(error.dot(edge->information * error), 6.0 * 9.0) << "as exact as it says";
}

TEST(SurfaceEdge, WhatTheSurfacesLeaveOpenStaysWhereItWas) {
  const Rigid3 start = kOff * kTruth;
  const auto edge = align_surface_edge(first_view(kOneWall), {0, 1}, look(kOneWall, kTruth, 2), start, {},
                                       kSurfaceCamera, {});
  ASSERT_TRUE(edge.has_value());
  const Eigen::Vector3d middle(0.0, 0.0, 2.0);  // of the wall: turning the camera about it is no slide
  const Eigen::Vector3d slid = edge->b_from_a * middle - start * middle;
  EXPECT_LT(slid.head<2>().norm(), 0.003) << "along the wall";
  EXPECT_LT(std::abs((edge->b_from_a.inverse().translation - kTruth.inverse().translation).z()), 0.0015)
      << "towards it";
}

TEST(SurfaceEdge, GreyValuesHoldWhatTheSurfacesLeaveOpen) {
  const auto samples = features::sample_photometric(features::make_photometric_image(picture({})),
                                                    look(kOneWall, {}, 1), kSurfaceCamera, {});
  const auto aligned = [&](const cv::Mat& second) {
    const features::PhotometricImage image = features::make_photometric_image(second);
    return align_surface_edge(first_view(kOneWall), {0, 1}, look(kOneWall, kTruth, 2), kOff * kTruth, {},
                              kSurfaceCamera, {}, {&samples, &image});
  };
  const auto alone = align_surface_edge(first_view(kOneWall), {0, 1}, look(kOneWall, kTruth, 2),
                                        kOff * kTruth, {}, kSurfaceCamera, {});
  const auto edge = aligned(picture(kTruth));
  const auto repainted = aligned(picture(kTruth, 6));
  ASSERT_TRUE(alone && edge && repainted);
  const Eigen::Vector3d middle(0.0, 0.0, 2.0);
  const auto slid = [&](const maps::SurfaceEdge& e) {
    return (e.b_from_a * middle - kTruth * middle).head<2>().norm();
  };
  EXPECT_GT(slid(*alone), 0.01);
  EXPECT_LT(slid(*edge), 0.001);
  const geometry::Vector6d error = geometry::log_se3(kTruth * edge->b_from_a.inverse());
  EXPECT_LT(error.dot(edge->information * error), 6.0 * 9.0) << "as exact as it says";
  EXPECT_NEAR(slid(*repainted), slid(*alone), 1e-9) << "a picture of something else is not believed";
}

TEST(SurfaceEdge, ADepthImageTakenLaterIsAlignedWhereItWasTaken) {
  const Rigid3 later(geometry::exp_so3({0.0, 0.01, 0.0}), Eigen::Vector3d(0.004, 0.0, -0.006));
  const auto edge = align_surface_edge(first_view(kCorner), {0, 1}, look(kCorner, later * kTruth, 2), kTruth,
                                       later, kSurfaceCamera, {});
  ASSERT_TRUE(edge.has_value());
  EXPECT_LT(metres_apart(edge->b_from_a, kTruth), 0.0015);
}

TEST(SurfaceEdge, WithoutOverlapThereIsNone) {
  const Rigid3 away(geometry::exp_so3({0.0, 2.5, 0.0}), Eigen::Vector3d::Zero());
  EXPECT_FALSE(
      align_surface_edge(first_view(kCorner), {0, 1}, look(kCorner, kTruth, 2), away, {}, kSurfaceCamera, {})
          .has_value());
  EXPECT_FALSE(align_surface_edge(first_view(kCorner), {0, 1}, look(kCorner, kTruth, 2), kTruth, {},
                                  kSurfaceCamera, {0.25, 0.5})
                   .has_value())
      << "all of it is beyond the largest depth";
  EXPECT_FALSE(
      align_surface_edge(first_view(kCorner), {0, 1}, cv::Mat(), kTruth, {}, kSurfaceCamera, {}).has_value());
  maps::Keyframe bare;
  bare.id = {0, 0};
  EXPECT_FALSE(
      align_surface_edge(bare, {0, 1}, look(kCorner, kTruth, 2), kTruth, {}, kSurfaceCamera, {}).has_value());
}

/// A keyframe's surface is where its colour camera was: what its depth camera measured later is carried back.
TEST(SurfaceEdge, AKeyframesSurfaceIsThatOfItsColourImage) {
  const Rigid3 later(geometry::exp_so3({0.0, 0.02, 0.0}), Eigen::Vector3d(0.02, 0.0, -0.03));
  LocalMapper mapper({}, {}, kSurfaceCamera, 0);
  maps::Map map;
  sensor::RgbdFrame frame;
  frame.depth = look(kCorner, later, 3);
  tracking::TrackResult track;
  track.depth_from_camera = later;
  track.features = std::make_shared<features::FrameFeatures>();
  const core::KeyframeId id = mapper.insert(map, frame, track, {});
  int near = 0;
  for (const maps::SurfaceSample& s : map.keyframe(id).surface) {
    double least = 1.0;
    for (const Wall& wall : kCorner)
      least = std::min(least, std::abs(wall.normal.dot(s.point.cast<double>()) - wall.distance));
    near += least < 0.012 ? 1 : 0;
  }
  EXPECT_GT(near, static_cast<int>(0.97 * static_cast<double>(map.keyframe(id).surface.size())));
}

}  // namespace
}  // namespace plumbline::mapping
