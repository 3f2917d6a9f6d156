// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/calib3d.hpp>
#include <random>

#include "plumbline/optimize/camera_calibration.hpp"
#include "plumbline/sensor/recalibration.hpp"

namespace plumbline::optimize {
namespace {

using geometry::Vector6d;

Eigen::Vector2d lens_pixel(const sensor::Camera& camera, const Eigen::Vector2d& undistorted) {
  return sensor::ImageModel(camera.color, camera).lens_pixel(undistorted);
}

sensor::Camera kinect() {
  sensor::Camera camera;
  camera.color = {640, 480, 520.0, 518.0, 318.0, 243.0};
  camera.distortion = {0.2, -0.5, 0.001, -0.002, 0.3};
  return camera;
}

/// Pixel and depth of a point as the true camera measures them: the row that shows it was read when the
/// camera had moved on.
bool see(const sensor::Camera& camera, const CalibrationPose& pose, const Eigen::Vector3d& point,
         CalibrationObservation& seen) {
  Eigen::Vector3d p = pose.camera_from_world * point;
  for (int i = 0; i < 10; ++i) {
    // Far outside, the distortion's polynomial folds back into the picture.
    if (p.z() < 0.3 || !camera.color.contains(camera.color.project(p))) return false;
    seen.pixel = lens_pixel(camera, camera.color.project(p));
    const double seconds = camera.readout_s.value_or(0.0) * (seen.pixel.y() / camera.color.height - 0.5);
    p = geometry::exp_se3(seconds * pose.velocity) * (pose.camera_from_world * point);
  }
  seen.ray = p.head<2>() / p.z();
  seen.depth =
      p.z() / (1.0 - p.z() * (camera.depth_slope[0] * seen.ray.x() + camera.depth_slope[1] * seen.ray.y()));
  const Eigen::Vector3d moved = pose.velocity.head<3>() + pose.velocity.tail<3>().cross(p);
  seen.depth_rate = moved.z();  // of a surface that faces the camera
  seen.depth += camera.depth_delay_s * seen.depth_rate;
  seen.depth_sigma = 0.01;
  return camera.color.contains(seen.pixel);
}

/// A camera that looks about in a room and swings while it does.
CalibrationProblem room(const sensor::Camera& truth, const sensor::Camera& given, double noise_px,
                        unsigned seed = 5) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::normal_distribution<double> normal;
  CalibrationProblem problem;
  problem.camera = given;
  for (int i = 0; i < 14; ++i) {
    CalibrationPose pose;
    Vector6d xi;
    xi << 0.5 * uniform(random), 0.3 * uniform(random), 0.5 * uniform(random), 0.3 * uniform(random),
        0.5 * uniform(random), 0.3 * uniform(random);
    pose.camera_from_world = geometry::exp_se3(xi);
    for (int k = 0; k < 6; ++k) pose.velocity(k) = 0.6 * uniform(random);
    pose.fixed = i == 0;
    pose.block = i;
    problem.poses.push_back(pose);
  }
  while (problem.points.size() < 160) {
    const Eigen::Vector3d point(2.0 * uniform(random), 1.5 * uniform(random), 2.5 + uniform(random));
    for (std::size_t i = 0; i < problem.poses.size(); ++i) {
      CalibrationObservation seen;
      if (!see(truth, problem.poses[i], point, seen)) continue;
      seen.pose = static_cast<int>(i);
      seen.point = static_cast<int>(problem.points.size());
      seen.pixel += noise_px * Eigen::Vector2d(normal(random), normal(random));
      seen.depth += 0.01 * noise_px * normal(random);
      problem.observations.push_back(seen);
    }
    problem.points.push_back(point);
  }
  return problem;
}

/// About the camera as it is given; nothing is known of whether it is right.
CameraPrior open_prior() {
  CameraPrior prior;
  prior.right_sigma = CameraChange{{0.001, 0.0002, 0.001, 0.001, 1.0, 1.0, 0.003, 0.003, 0.001}};
  prior.wrong_sigma = CameraChange{{0.05, 0.02, 0.05, 0.05, 20.0, 20.0, 0.2, 0.2, 0.02}};
  prior.wrong.fill(0.5);
  return prior;
}

/// Linearised again where the evidence led, until that is where it stays.
CameraPosterior solve(CalibrationProblem problem, const CameraPrior& prior = open_prior()) {
  CameraPosterior known;
  for (int round = 0; round < 4; ++round) {
    const auto evidence = camera_evidence(problem, known.mean);
    EXPECT_TRUE(evidence);
    if (evidence) known = camera_posterior({*evidence}, prior);
  }
  return known;
}

TEST(CameraCalibration, FindsWhatIsWrong) {
  sensor::Camera given = kinect();
  sensor::Camera truth = given;
  truth.color.fx *= 1.02;
  truth.color.fy *= 1.02;
  truth.color.cx += 4.0;
  truth.distortion[0] += 0.05;
  truth.readout_s = 0.018;
  truth.depth_slope = {0.02, -0.01};
  truth.depth_delay_s = -0.015;
  CalibrationProblem problem = room(truth, given, 0.3);
  const CameraPosterior known = solve(problem);
  const CameraChange& change = known.mean;
  const auto there = camera_evidence(problem, change);
  ASSERT_TRUE(there);
  EXPECT_LT(there->cost, 0.2 * static_cast<double>(problem.observations.size()));
  const sensor::Camera found = changed_camera(given, change);
  EXPECT_NEAR(found.color.fx, truth.color.fx, 1.5);
  EXPECT_NEAR(found.color.cx, truth.color.cx, 1.5);
  EXPECT_NEAR(found.distortion[0], truth.distortion[0], 0.01);
  EXPECT_NEAR(*found.readout_s, 0.018, 0.001);
  EXPECT_NEAR(found.depth_slope[0], 0.02, 0.002);
  EXPECT_NEAR(found.depth_slope[1], -0.01, 0.002);
  EXPECT_NEAR(found.depth_delay_s, -0.015, 0.001);
}

TEST(CameraCalibration, KnowsWhichNumbersAreWrong) {
  sensor::Camera truth = kinect();
  truth.readout_s = 0.02;
  truth.color.cx += 8.0;
  const CameraPosterior known = solve(room(truth, kinect(), 0.3));
  EXPECT_GT(known.wrong[kReadoutGroup], 0.99);
  EXPECT_GT(known.wrong[kCentreGroup], 0.99);
  EXPECT_LT(known.wrong[kSlopeGroup], 0.3);
  EXPECT_LT(known.wrong[kDelayGroup], 0.3);
  EXPECT_NEAR(known.mean[kReadout], 0.02, 0.002);
  EXPECT_NEAR(known.mean[kDelay], 0.0, 0.0005);
}

TEST(CameraCalibration, AFileThatIsRightHardlyMoves) {
  const CameraPosterior known = solve(room(kinect(), kinect(), 0.3));
  for (std::size_t g = 0; g < kCameraGroups; ++g) EXPECT_LT(known.wrong[g], 0.4) << g;
  const CameraChange off = known.mean.cwiseAbs().cwiseQuotient(open_prior().right_sigma);
  EXPECT_LT(off.maxCoeff(), 2.0) << off.transpose();
}

// The estimate follows the evidence without a step: the further the truth is from the file, the further it is
// found.
TEST(CameraCalibration, IsContinuousInTheTruth) {
  double before = -1e-4;
  for (int i = 0; i <= 10; ++i) {
    sensor::Camera truth = kinect();
    truth.color.fx *= 1.0 + 0.001 * i;
    truth.color.fy *= 1.0 + 0.001 * i;
    const double found = solve(room(truth, kinect(), 0.3)).mean[kFocal];
    EXPECT_GT(found, before - 2e-4) << i;
    EXPECT_LT(found, before + 3e-3) << i;
    before = found;
  }
}

TEST(CameraCalibration, NoPictureIsReadBeforeItIsTaken) {
  sensor::Camera truth = kinect();
  truth.readout_s = -0.01;
  EXPECT_GE(solve(room(truth, kinect(), 0.3)).mean[kReadout], 0.0);
}

// Errors of all numbers, over rooms with other noise, are as large as they are said to be.
TEST(CameraCalibration, ToldErrorsAreTrue) {
  sensor::Camera truth = kinect();
  truth.color.fx *= 1.015;
  truth.color.fy *= 1.015;
  truth.readout_s = 0.015;
  truth.depth_slope = {0.015, 0.01};
  truth.depth_delay_s = 0.01;
  const CameraChange right = change_between(kinect(), truth);
  CameraChange squares = CameraChange::Zero();
  constexpr int kRooms = 12;
  for (unsigned seed = 1; seed <= kRooms; ++seed) {
    const CameraPosterior known = solve(room(truth, kinect(), 0.3, seed));
    squares += (known.mean - right).cwiseAbs2().cwiseQuotient(known.covariance.diagonal()) / kRooms;
  }
  for (const CameraUnknown u : {kFocal, kReadout, kSlopeX, kSlopeY, kDelay}) {
    EXPECT_LT(std::sqrt(squares[u]), 1.6) << u;
    EXPECT_GT(std::sqrt(squares[u]), 0.1) << u;
  }
}

TEST(CameraCalibration, BlocksAddUpToTheEvidence) {
  CalibrationProblem problem = room(kinect(), kinect(), 0.3);
  const auto evidence = camera_evidence(problem, CameraChange::Zero());
  ASSERT_TRUE(evidence);
  ASSERT_EQ(evidence->blocks.size(), problem.poses.size());
  EvidenceBlock sum;
  for (const EvidenceBlock& b : evidence->blocks) {
    sum.gradient += b.gradient;
    sum.information += b.information;
  }
  EXPECT_TRUE(sum.information.isApprox(evidence->all.information, 1e-9));
  EXPECT_TRUE(sum.gradient.isApprox(evidence->all.gradient, 1e-9));
}

// What a solution with poses and points costs elsewhere is what the quadratic function of the camera says,
// but for robust losses.
TEST(CameraCalibration, EvidenceForetellsTheCost) {
  sensor::Camera truth = kinect();
  truth.readout_s = 0.01;
  CalibrationProblem problem = room(truth, kinect(), 0.3);
  const auto here = camera_evidence(problem, CameraChange::Zero());
  ASSERT_TRUE(here);
  for (const auto& [u, by] : {std::pair{kFocal, 0.002}, std::pair{kReadout, 0.003}, std::pair{kSlopeX, 0.004},
                              std::pair{kSlopeY, -0.004}, std::pair{kCentreX, 1.0}, std::pair{kK1, 0.01},
                              std::pair{kDelay, 0.005}}) {
    CameraChange step = CameraChange::Zero();
    step[u] = by;
    const auto there = camera_evidence(problem, step);
    ASSERT_TRUE(there);
    const double expected = here->cost_of(step) - here->cost;
    const double ends_within = 1e-4 * here->cost;  // of its minimum, where an adjustment ends
    EXPECT_NEAR(there->cost - here->cost, expected, 0.3 * std::abs(expected) + ends_within)
        << step.transpose();
  }
}

TEST(CameraCalibration, PosesAndPointsFollowTheCamera) {
  sensor::Camera truth = kinect();
  truth.readout_s = 0.01;
  CalibrationProblem problem = room(truth, kinect(), 0.3);
  ASSERT_TRUE(camera_evidence(problem, CameraChange::Zero()));
  CameraChange step = CameraChange::Zero();
  step[kFocal] = 0.005;
  step[kSlopeX] = 0.004;
  const CalibrationProblem before = problem;
  ASSERT_TRUE(camera_evidence(problem, step));

  // Where they were expected with the other camera is nearer to where they are than where they had been.
  const auto stride = static_cast<Eigen::Index>(6 * before.poses.size());
  double moved = 0.0, missed = 0.0;
  for (std::size_t i = 0; i < before.points.size(); ++i) {
    const Eigen::Vector3d follows =
        before.following.middleRows<3>(stride + 3 * static_cast<Eigen::Index>(i)) * step;
    moved += (problem.points[i] - before.points[i]).norm();
    missed += (problem.points[i] - before.points[i] - follows).norm();
  }
  EXPECT_GT(moved, 0.0);
  EXPECT_LT(missed, 0.3 * moved);
}

TEST(CameraCalibration, NothingSeenIsNoSolution) {
  CalibrationProblem problem;
  problem.camera = kinect();
  EXPECT_FALSE(camera_evidence(problem, CameraChange::Zero()));
}

// A few points in one place seen by one pose: nothing holds the camera but the prior.
TEST(CameraCalibration, PriorHoldsWhatNothingTells) {
  CalibrationProblem problem = room(kinect(), kinect(), 0.0);
  problem.poses.resize(1);
  std::vector<CalibrationObservation> kept;
  for (const CalibrationObservation& o : problem.observations) {
    if (o.pose == 0 && o.point < 3) kept.push_back(o);
  }
  ASSERT_FALSE(kept.empty());
  problem.observations = kept;
  const CameraPosterior known = solve(problem);
  EXPECT_NEAR(known.mean[kFocal], 0.0, 1e-6);
  EXPECT_NEAR(known.mean[kReadout], 0.0, 1e-3);
  EXPECT_GT(known.covariance(kFocal, kFocal), 0.01 * 0.01);
}

TEST(CameraCalibration, DistortsAsOpenCv) {
  const sensor::Camera camera = kinect();
  const sensor::Pinhole& c = camera.color;
  const Eigen::Vector3d ray = c.unproject(500.0, 90.0, 1.0);
  std::vector<cv::Point2d> expected;
  cv::projectPoints(std::vector<cv::Point3d>{{ray.x(), ray.y(), 1.0}}, cv::Vec3d(), cv::Vec3d(),
                    cv::Matx33d(c.fx, 0, c.cx, 0, c.fy, c.cy, 0, 0, 1),
                    std::vector<double>(camera.distortion.begin(), camera.distortion.end()), expected);
  const Eigen::Vector2d pixel = lens_pixel(camera, {500.0, 90.0});
  EXPECT_NEAR(pixel.x(), expected[0].x, 1e-9);
  EXPECT_NEAR(pixel.y(), expected[0].y, 1e-9);
}

}  // namespace
}  // namespace plumbline::optimize
