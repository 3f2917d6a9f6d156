// SPDX-License-Identifier: BSD-3-Clause
// Errors that the poses of a path may have, in a box whose walls are rendered at true poses.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <random>

#include "../../../src/check/untied_path.hpp"
#include "plumbline/check/path_samples.hpp"

namespace plumbline::check {
namespace {

using geometry::Rigid3;

const sensor::Pinhole kCamera{160, 120, 130.0, 130.0, 79.5, 59.5};
const Eigen::Vector3d kHalf(2.5, 1.3, 2.0);  // of the box
constexpr double kStep_s = 1.0 / 3.0;

/// On a circle, looking outwards.
Rigid3 true_pose(double stamp) {
  const double angle = 0.25 * stamp;
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()).toRotationMatrix();
  return {turn, turn * Eigen::Vector3d(0.0, 0.1 * std::sin(stamp), 0.7)};
}

/// Patches of grey by place.
std::uint8_t grey_at(const Eigen::Vector3d& p) {
  const Eigen::Vector3i cell = (p / 0.17).array().floor().cast<int>();
  const int mixed = cell.x() * 7919 + cell.y() * 104729 + cell.z() * 1299709;
  return static_cast<std::uint8_t>(40 + (mixed & 0x7fffffff) % 170);
}

SmallFrame film(double stamp) {
  SmallFrame frame;
  frame.stamp = frame.depth_stamp = stamp;
  frame.gray.create(kCamera.height, kCamera.width, CV_8UC1);
  frame.depth.create(kCamera.height, kCamera.width, CV_16UC1);
  const Rigid3 pose = true_pose(stamp);
  for (int v = 0; v < kCamera.height; ++v) {
    for (int u = 0; u < kCamera.width; ++u) {
      const Eigen::Vector3d ray = pose.rotation * kCamera.unproject(u, v, 1.0);
      double z = 100.0;
      for (int k = 0; k < 3; ++k)
        z = std::min(z, (std::copysign(kHalf[k], ray[k]) - pose.translation[k]) / ray[k]);
      frame.gray.at<std::uint8_t>(v, u) = grey_at(pose.translation + (z - 1e-6) * ray);
      frame.depth.at<std::uint16_t>(v, u) = static_cast<std::uint16_t>(std::lround(z * kDepthUnits_per_m));
    }
  }
  return frame;
}

/// The report on a path whose positions are off by offset(stamp).
template <typename Offset>
std::pair<CheckReport, geometry::Trajectory> checked(const Offset& offset, int threads,
                                                     std::vector<CameraShift> camera = {}) {
  CheckInput input;
  input.camera = std::move(camera);
  input.ways.push_back({kCamera, 0.0, {}});
  for (std::size_t i = 0; i < 60; ++i) {
    const double stamp = kStep_s * static_cast<double>(i);
    Rigid3 pose = true_pose(stamp);
    pose.translation += offset(stamp);
    input.ways.front().path.push_back({stamp, pose});
    input.frames.push_back({i, 0, stamp, stamp, FrameChoice::Use::kAnchor});
  }
  input.read = [](std::size_t number) -> core::Result<SmallFrame> {
    return film(kStep_s * static_cast<double>(number));
  };
  return {*check_path(input, core::Executor(threads)), input.ways.front().path};
}

Eigen::Vector3d bent(double stamp) { return {0.015 * std::sin(1.3 * stamp), 0.0, 0.001 * stamp}; }

/// A point before the camera of a pose, and where a sample of its error puts it.
Eigen::Vector3d before(const Rigid3& pose) { return pose * Eigen::Vector3d(0.3, 0.1, 1.6); }
Eigen::Vector3d moved(const Rigid3& pose, const geometry::Vector6d& motion) {
  const Eigen::Vector3d turn = motion.tail<3>();
  return pose *
         (Eigen::Vector3d(0.3, 0.1, 1.6) + motion.head<3>() + turn.cross(Eigen::Vector3d(0.3, 0.1, 1.6)));
}

TEST(CheckSamples, IntervalsHoldTrueLengthsAndAreNotWide) {
  const auto [report, path] = checked(bent, 2);
  ASSERT_EQ(report.samples.size(), path.size());
  std::vector<geometry::PoseSamples> samples;
  for (const geometry::StampedPose& pose : path) samples.push_back(samples_of(report, 0, pose));

  std::mt19937 random(5);
  int held = 0;
  constexpr int kAll = 1000;
  std::vector<double> errors, widths;
  for (int n = 0; n < kAll; ++n) {
    const std::size_t i = random() % path.size(), j = (i + 1 + random() % (path.size() - 1)) % path.size();
    const Rigid3 &a = path[i].world_from_camera, &b = path[j].world_from_camera;
    const double told = (before(a) - before(b)).norm();
    double sum = 0.0;
    for (std::size_t s = 0; s < samples[i].size(); ++s)
      sum += std::pow((moved(a, samples[i][s]) - moved(b, samples[j][s])).norm() - told, 2);
    widths.push_back(2.04 * std::sqrt(sum / static_cast<double>(samples[i].size())));
    errors.push_back(
        std::abs((before(true_pose(path[i].stamp)) - before(true_pose(path[j].stamp))).norm() - told));
    held += errors.back() < widths.back() ? 1 : 0;
  }
  std::sort(errors.begin(), errors.end());
  std::sort(widths.begin(), widths.end());
  EXPECT_GE(held, 850);
  EXPECT_LE(widths[kAll / 2], 2.5 * errors[kAll * 95 / 100]);
}

TEST(CheckSamples, FollowTheErrorToExpectAndTheMotionThatWasFound) {
  const auto [right, path] = checked([](double) { return Eigen::Vector3d::Zero(); }, 1);
  const auto [wrong, other] = checked(bent, 1);
  const auto [again, same] = checked(bent, 3);
  const auto size = [](const CheckReport& report, const geometry::Trajectory& along) {
    double sum = 0.0;
    for (const geometry::StampedPose& pose : along) {
      for (const geometry::Vector6d& motion : samples_of(report, 0, pose))
        sum += motion.head<3>().squaredNorm();
    }
    return std::sqrt(sum / 32.0 / static_cast<double>(along.size()));
  };
  EXPECT_NEAR(size(wrong, other), size(right, path) * wrong.expected_m / right.expected_m,
              0.1 * size(wrong, other));
  EXPECT_GT(size(wrong, other), 2.0 * size(right, path));
  for (std::size_t i = 0; i < same.size(); ++i)
    EXPECT_EQ(samples_of(wrong, 0, other[i]), samples_of(again, 0, same[i])) << i;

  // Another path, and one of which nothing is known.
  EXPECT_TRUE(samples_of(wrong, 1, other[0])[0].hasNaN());
  EXPECT_TRUE(samples_of({}, 0, other[0])[0].hasNaN());
}

TEST(CheckSamples, WhereNothingIsSeenTwiceTheErrorGrowsWithThePath) {
  const auto [report, path] = checked(bent, 1);
  EXPECT_EQ(report.align[kRevisit].pairs, 0U);
  EXPECT_GT(report.drift_m, 0.0);
  EXPECT_LT(report.drift_m, 0.01 * report.path_m);
  EXPECT_GE(report.expected_m, report.drift_m);
  EXPECT_NE(sentence(report).find("nothing was seen twice"), std::string::npos);
}

TEST(CheckSamples, CameraMovesPlacesTogetherAndIsPartOfTheErrorToExpect) {
  const auto right = [](double) { return Eigen::Vector3d::Zero(); };
  const auto [before, path] = checked(right, 1);
  EXPECT_EQ(before.camera_m, 0.0);

  // One number that makes the path larger, told at every third pose, and one that moves it as a whole.
  std::vector<CameraShift> camera;
  for (std::size_t i = 0; i < path.size(); i += 3) {
    const Rigid3& pose = path[i].world_from_camera;
    geometry::Vector6d larger = geometry::Vector6d::Zero(), whole = geometry::Vector6d::Zero();
    larger.head<3>() = pose.rotation.transpose() * (0.05 * pose.translation);
    whole.head<3>() = pose.rotation.transpose() * Eigen::Vector3d(0.3, 0.2, 0.1);
    camera.push_back({0, path[i].stamp, {larger, whole}});
  }
  const auto [after, same] = checked(right, 1, camera);

  double sum = 0.0;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const auto& pose : path)
    middle += pose.world_from_camera.translation / static_cast<double>(path.size());
  for (const auto& pose : path) sum += (pose.world_from_camera.translation - middle).squaredNorm();
  EXPECT_NEAR(after.camera_m, 0.05 * std::sqrt(sum / static_cast<double>(path.size())), 0.1 * after.camera_m);
  EXPECT_GT(after.expected_m, after.camera_m);

  // Distances across the path grow and shrink together.
  const auto across = [&](const CheckReport& report, std::size_t s, std::size_t i) {
    const Rigid3 &a = path[i].world_from_camera, &b = path[i + 36].world_from_camera;
    return (a * samples_of(report, 0, path[i])[s].head<3>() -
            b * samples_of(report, 0, path[i + 36])[s].head<3>())
                   .norm() /
               (a.translation - b.translation).norm() -
           1.0;
  };
  double together = 0.0, alone = 0.0;
  for (std::size_t s = 0; s < geometry::kPoseSamples; ++s) {
    together += across(after, s, 0) * across(after, s, 18);
    alone += across(after, s, 0) * across(after, s, 0);
  }
  EXPECT_GT(together, 0.5 * alone);
}

TEST(CheckSamples, WhatLiesBetweenNoTwoTiedPlacesIsUntied) {
  std::vector<Way> ways(2);
  for (std::size_t i = 0; i <= 20; ++i) {
    for (Way& way : ways)
      way.path.push_back(
          {static_cast<double>(i), {Eigen::Matrix3d::Identity(), {0.5 * static_cast<double>(i), 0, 0}}});
  }
  EXPECT_NEAR(untied_length(ways, {}), 20.0, 1e-9);
  EXPECT_NEAR(untied_length(ways, {{0, 12.0, 0, 4.0}, {0, 6.0, 0, 14.0}}), 15.0, 1e-9);
  EXPECT_NEAR(untied_length(ways, {{0, 2.0, 1, 3.0}}), 20.0, 1e-9) << "one meeting ties nothing";
  EXPECT_NEAR(untied_length(ways, {{0, 2.0, 1, 3.0}, {1, 13.0, 0, 18.0}}), 7.0, 1e-9);
}

}  // namespace
}  // namespace plumbline::check
