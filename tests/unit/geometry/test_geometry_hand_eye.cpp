// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "plumbline/geometry/hand_eye.hpp"
#include "random_world.hpp"

namespace plumbline::geometry {
namespace {

constexpr double kDegree = M_PI / 180.0;

/// The second camera looks backwards, 10 cm behind the first and tilted.
Rigid3 back_camera() {
  return {exp_so3({0.0, M_PI, 0.0}) * exp_so3({0.1, 0.05, -0.07}), Eigen::Vector3d(0.02, -0.03, -0.1)};
}

enum class Walk { kHandheld, kWheels, kSlide };

/// The reference camera's path: turns about all axes, about its vertical only, or about none.
Rigid3 place(Walk walk, double t) {
  const Eigen::Vector3d at(1.5 * std::sin(0.4 * t), 0.1 * std::sin(1.3 * t), 1.2 * std::cos(0.5 * t));
  const Eigen::Vector3d turns(0.3 * std::sin(1.1 * t), 0.9 * std::sin(0.6 * t), 0.25 * std::sin(1.7 * t));
  if (walk == Walk::kHandheld) return {exp_so3(turns), at};
  if (walk == Walk::kSlide) return {Eigen::Matrix3d::Identity(), at};
  return {exp_so3({0.0, 1.2 * std::sin(0.6 * t), 0.0}), Eigen::Vector3d(at.x(), 0.0, at.z())};
}

struct Paths {
  Trajectory reference, camera;
};

/// Errors of a tracker, metres, and half as much in radians.
struct Noise {
  double pose = 0.0;  ///< of each pose by itself
  double step = 0.0;  ///< of each step, which add up
};

/// Both paths in frames of their own, 20 poses a second.
Paths paths(Walk walk, const Rigid3& x, double seconds, const Noise& noise, tests::Random& random) {
  const auto small = [&](double size) {
    Vector6d xi;
    for (Eigen::Index i = 0; i < 6; ++i) xi[i] = random.normal(i < 3 ? size : 0.5 * size);
    return exp_se3(xi);
  };
  Paths result;
  Rigid3 a, b(exp_so3({0.4, -1.0, 2.0}), Eigen::Vector3d(3.0, -1.0, 2.0));
  for (int frame = 0; frame * 0.05 < seconds; ++frame) {
    const double t = 0.05 * frame;
    if (frame > 0) {
      const Rigid3 step = place(walk, t - 0.05).inverse() * place(walk, t);
      a = a * step * small(noise.step);
      b = b * x.inverse() * step * x * small(noise.step);
    }
    result.reference.push_back({100.0 + t, a * small(noise.pose)});
    result.camera.push_back({100.0 + t, b * small(noise.pose)});
  }
  return result;
}

/// Error (rho, phi) in the axes of the covariance.
Vector6d error_of(const HandEye& found, const Rigid3& truth) {
  Vector6d error;
  error << truth.translation - found.reference_from_camera.translation,
      log_so3(truth.rotation * found.reference_from_camera.rotation.transpose());
  return error;
}

/// Mean of the squared errors in standard deviations, of which 6 are right, over worlds of 30 s.
double mean_chi2(const Noise& noise) {
  constexpr int kRounds = 40;
  double sum = 0.0;
  for (int round = 0; round < kRounds; ++round) {
    tests::Random random(static_cast<std::uint32_t>(round + 1));
    const Rigid3 truth = round % 2 == 0 ? back_camera() : random.pose(3.1, 0.3);
    const Paths both = paths(Walk::kHandheld, truth, 30.0, noise, random);
    const HandEye found = find_hand_eye(common_motions(both.reference, both.camera));
    EXPECT_TRUE(found.determined());
    const Vector6d error = error_of(found, truth);
    EXPECT_LT(error.head<3>().norm(), 0.005) << round;
    EXPECT_LT(error.tail<3>().norm(), 0.2 * kDegree) << round;
    sum += error.dot(found.covariance.inverse() * error) / kRounds;
  }
  return sum;
}

TEST(HandEye, CamerasBackToBackWithinTheirStandardDeviations) {
  // Errors that add up are common to all motions that overlap: counted as independent, they would give
  // several times as much.
  const double drift = mean_chi2({0.0, 0.0005});
  EXPECT_GT(drift, 2.0);
  EXPECT_LT(drift, 12.0);

  // Errors of single poses are nearly independent: the standard deviations are too large, never too small.
  EXPECT_LT(mean_chi2({0.002, 0.0}), 6.0);
}

TEST(HandEye, PathsWithoutNoiseGiveTheExactPose) {
  tests::Random random(3);
  const Paths both = paths(Walk::kHandheld, back_camera(), 20.0, {}, random);
  const HandEye found = find_hand_eye(common_motions(both.reference, both.camera));
  EXPECT_LT(error_of(found, back_camera()).norm(), 1e-6);
  EXPECT_GT(found.covariance.diagonal().minCoeff(), 0.0);
  // Three durations share twenty seconds of path.
  EXPECT_GT(found.independent, 15.0);
  EXPECT_LT(found.independent, 30.0);
}

TEST(HandEye, JumpsOfATrackerCountLittle) {
  tests::Random random(4);
  Paths both = paths(Walk::kHandheld, back_camera(), 40.0, {0.001, 0.0002}, random);
  const Rigid3 jump(exp_so3({0.0, 0.3, 0.1}), Eigen::Vector3d(0.5, 0.2, -0.3));
  for (std::size_t i = 300; i < both.camera.size(); ++i) {
    if (i % 200 == 0) both.camera[i].world_from_camera = both.camera[i].world_from_camera * jump;
    if (i > 500) both.reference[i].world_from_camera = jump * both.reference[i].world_from_camera;
  }
  const HandEye found = find_hand_eye(common_motions(both.reference, both.camera));
  EXPECT_LT(error_of(found, back_camera()).head<3>().norm(), 0.005);
  EXPECT_LT(error_of(found, back_camera()).tail<3>().norm(), 0.2 * kDegree);
}

TEST(HandEye, WheelsLeaveTheOffsetAlongTheAxisFree) {
  for (const double noise : {0.0, 0.001}) {
    tests::Random random(5);
    const Paths both = paths(Walk::kWheels, back_camera(), 40.0, {noise, 0.2 * noise}, random);
    const auto motions = common_motions(both.reference, both.camera);
    const HandEye found = find_hand_eye(motions);
    EXPECT_FALSE(found.determined());
    EXPECT_FALSE(found.free_rotation);
    ASSERT_EQ(found.free_positions.size(), 1U);
    EXPECT_GT(std::abs(found.free_positions.front().y()), 0.99);

    // The offset measured with a ruler completes it; the other two coordinates are not told.
    HandEyePrior prior;
    prior.reference_from_camera.translation.y() = -0.032;
    prior.sigma_m.y() = 0.003;
    const HandEye known = find_hand_eye(motions, prior);
    EXPECT_TRUE(known.determined());
    const Vector6d error = error_of(known, back_camera());
    EXPECT_NEAR(error.y(), 0.002, 0.001);
    EXPECT_LT(std::hypot(error.x(), error.z()), 0.006);
    EXPECT_LT(error.tail<3>().norm(), 0.2 * kDegree);
    EXPECT_NEAR(std::sqrt(known.covariance(1, 1)), 0.003, 0.0005);
  }
}

TEST(HandEye, PathsWithoutTurnsLeaveThePositionFree) {
  tests::Random random(6);
  const Paths both = paths(Walk::kSlide, back_camera(), 40.0, {0.0005, 0.0001}, random);
  const HandEye found = find_hand_eye(common_motions(both.reference, both.camera));
  EXPECT_EQ(found.free_positions.size(), 3U);
}

TEST(HandEye, NoMotionLeavesEverythingFree) {
  const HandEye found = find_hand_eye({});
  EXPECT_TRUE(found.free_rotation);
  EXPECT_EQ(found.free_positions.size(), 3U);
  EXPECT_EQ(found.motions, 0U);
  EXPECT_TRUE(common_motions({}, {}).empty());
  const StampedPose one{1.0, {}};
  EXPECT_TRUE(common_motions({one}, {one}).empty());
}

TEST(HandEye, CamerasAtDifferentTimes) {
  // Cameras that take turns: the reference camera's poses lie between those of the other one.
  tests::Random random(7);
  Paths both = paths(Walk::kHandheld, back_camera(), 30.0, {}, random);
  for (int i = 0; i < static_cast<int>(both.camera.size()); ++i) {
    auto& pose = both.camera[static_cast<std::size_t>(i)];
    const double t = 0.05 * i + 0.02;
    pose = {100.0 + t, place(Walk::kHandheld, t) * back_camera()};
  }
  const HandEye found = find_hand_eye(common_motions(both.reference, both.camera));
  EXPECT_LT(error_of(found, back_camera()).head<3>().norm(), 0.002);
}

TEST(ClockOffset, OfACameraWhoseClockIsLate) {
  for (const double late : {0.0, 0.037, -0.21}) {
    tests::Random random(8);
    Paths both = paths(Walk::kHandheld, back_camera(), 30.0, {0.001, 0.0002}, random);
    for (StampedPose& pose : both.camera) pose.stamp -= late;
    const ClockOffset found = find_clock_offset(both.reference, both.camera);
    EXPECT_NEAR(found.offset_s, late, 0.004);
    EXPECT_NEAR(found.offset_s, late, 4.0 * found.sigma_s + 1e-4);
    EXPECT_LT(found.sigma_s, 0.005);
  }
}

TEST(ClockOffset, IsNotKnownWithoutTurns) {
  tests::Random random(9);
  const Paths both = paths(Walk::kSlide, back_camera(), 30.0, {}, random);
  EXPECT_FALSE(find_clock_offset(both.reference, both.camera).sigma_s < 0.05);
  EXPECT_FALSE(find_clock_offset({}, {}).sigma_s < 0.05);
}

TEST(PoseBetween, NeighboursFarApartInTimeGiveNone) {
  const Rigid3 far(Eigen::Matrix3d::Identity(), Eigen::Vector3d(1.0, 0.0, 0.0));
  const Trajectory path = {{1.0, {}}, {1.1, far}, {2.0, far}};
  EXPECT_NEAR(pose_between(path, 1.05, 0.15)->translation.x(), 0.5, 1e-6);
  EXPECT_FALSE(pose_between(path, 1.5, 0.15).has_value());
  EXPECT_TRUE(pose_between(path, 2.0, 0.15).has_value());
  EXPECT_FALSE(pose_between(path, 0.9, 0.15).has_value());
  EXPECT_FALSE(pose_between(path, 2.1, 0.15).has_value());
}

}  // namespace
}  // namespace plumbline::geometry
