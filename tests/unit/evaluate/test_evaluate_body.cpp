// SPDX-License-Identifier: BSD-3-Clause
// A truth that holds the poses of another body than the camera, and estimates of another size.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <random>
#include <string>

#include "plumbline/evaluate/trajectory.hpp"

namespace {

using namespace plumbline;
using evaluate::evaluate_trajectory;
using evaluate::TrajectoryAlignment;
using evaluate::TrajectoryOptions;
using evaluate::TrajectoryReport;
using geometry::Rigid3;
using geometry::Trajectory;

constexpr double kDegree = 3.14159265358979323846 / 180.0;
constexpr double kNoise_m = 0.002;

/// A path of 20 s whose camera turns about `axes` of its axes.
Trajectory path_of(int axes, int poses = 600) {
  Trajectory path;
  for (int i = 0; i < poses; ++i) {
    const double t = i / 30.0;
    const Eigen::Vector3d turn(axes > 1 ? 0.3 * std::sin(t) : 0.0, axes > 0 ? 0.2 * t : 0.0,
                               axes > 2 ? 0.1 * std::cos(2.0 * t) : 0.0);
    path.push_back(
        {1000.0 + t,
         {geometry::exp_so3(turn), {std::cos(0.7 * t), 0.8 * std::sin(t), 0.3 * std::sin(2.3 * t)}}});
  }
  return path;
}

/// As tracked in another world, with noise.
Trajectory tracked(const Trajectory& truth, double scale = 1.0) {
  std::mt19937 random(3);
  const auto uniform = [&random] { return 2.0 * static_cast<double>(random()) / 4294967295.0 - 1.0; };
  const Rigid3 other_world(geometry::exp_so3({0.4, -1.1, 0.7}), {3.0, -2.0, 0.5});
  Trajectory estimate = truth;
  for (auto& [stamp, pose] : estimate) {
    pose.translation += kNoise_m * Eigen::Vector3d(uniform(), uniform(), uniform());
    pose.rotation =
        pose.rotation * geometry::exp_so3(0.002 * Eigen::Vector3d(uniform(), uniform(), uniform()));
    pose = other_world * pose;
    pose.translation *= scale;
  }
  return estimate;
}

/// The camera is 8 cm away from the marker and turned by 120 degrees.
Rigid3 marker_from_camera() {
  return Rigid3(geometry::exp_so3(120.0 * kDegree * Eigen::Vector3d::Ones().normalized()), {0.08, 0.0, 0.0})
      .inverse();
}

Trajectory marker_path(const Trajectory& camera) {
  Trajectory path = camera;
  for (auto& [stamp, pose] : path) pose = pose * marker_from_camera().inverse();
  return path;
}

TrajectoryReport measured(const Trajectory& estimate, const Trajectory& truth, const std::string& body = "",
                          TrajectoryAlignment align = TrajectoryAlignment::kSe3) {
  TrajectoryOptions options;
  options.body = body;
  options.align = align;
  const auto report = evaluate_trajectory(estimate, truth, options);
  EXPECT_TRUE(report) << report.error().message;
  return report ? *report : TrajectoryReport{};
}

void expect_marker(const Rigid3& found) {
  const Rigid3 off = marker_from_camera().inverse() * found;
  EXPECT_LT(off.translation.norm(), 0.001);
  EXPECT_LT(geometry::rotation_angle(off.rotation), 0.05 * kDegree);
}

TEST(EvaluateBody, IsFoundAndToldAndLeftIn) {
  const Trajectory truth = path_of(3);
  const TrajectoryReport report = measured(tracked(truth), marker_path(truth));
  ASSERT_TRUE(report.body);
  expect_marker(report.body->body_from_camera);
  EXPECT_FALSE(report.body->removed);
  EXPECT_NEAR(report.body->lever_m, 0.08, 0.001);
  EXPECT_NEAR(report.body->turn_deg, 120.0, 0.05);
  EXPECT_GT(report.ate_m.rmse, 0.01);
  EXPECT_DOUBLE_EQ(report.body->ate_before_m, report.ate_m.rmse);
  EXPECT_LT(report.body->ate_after_m, kNoise_m);

  ASSERT_EQ(report.warnings.size(), 1U);
  EXPECT_NE(report.warnings[0].find("8.0 cm away and turned by 120.0 degrees"), std::string::npos)
      << report.warnings[0];
  EXPECT_NE(report.warnings[0].find("--body fit"), std::string::npos);
}

TEST(EvaluateBody, IsTakenOutOnRequest) {
  const Trajectory truth = path_of(3);
  for (const TrajectoryAlignment align : {TrajectoryAlignment::kSe3, TrajectoryAlignment::kStart}) {
    const TrajectoryReport report = measured(tracked(truth), marker_path(truth), "fit", align);
    ASSERT_TRUE(report.body);
    EXPECT_TRUE(report.body->removed);
    EXPECT_LT(report.ate_m.rmse, align == TrajectoryAlignment::kSe3 ? kNoise_m : 4.0 * kNoise_m);
    EXPECT_LT(report.rotation_deg.rmse, 1.0);
    EXPECT_TRUE(report.warnings.empty()) << report.warnings[0];
    EXPECT_LT((report.truth[5].world_from_camera.translation - truth[5].world_from_camera.translation).norm(),
              0.001)
        << "the truth that charts draw is the camera's";

    const auto json = nlohmann::json::parse(to_json(report));
    EXPECT_TRUE(json["body"]["removed"].get<bool>());
    EXPECT_NEAR(json["body"]["lever_m"].get<double>(), 0.08, 0.001);
    EXPECT_NE(to_text(report).find("turned by 120."), std::string::npos) << to_text(report);
  }
}

TEST(EvaluateBody, IsTakenOutAsGiven) {
  const Trajectory truth = path_of(0);  // which does not determine it
  const Rigid3 body = marker_from_camera();
  const Eigen::Quaterniond q = body.quaternion();
  const std::string text = std::to_string(body.translation.x()) + "," + std::to_string(body.translation.y()) +
                           "," + std::to_string(body.translation.z()) + "," + std::to_string(q.x()) + "," +
                           std::to_string(q.y()) + "," + std::to_string(q.z()) + "," + std::to_string(q.w());
  const TrajectoryReport report = measured(tracked(truth), marker_path(truth), text);
  EXPECT_LT(report.ate_m.rmse, kNoise_m);
  EXPECT_LT(report.rotation_deg.mean, 1.0);
}

TEST(EvaluateBody, IsNotInventedWhereTheTruthIsTheCameras) {
  const Trajectory truth = path_of(3);
  const TrajectoryReport report = measured(tracked(truth), truth);
  EXPECT_FALSE(report.body);
  EXPECT_TRUE(report.warnings.empty()) << report.warnings[0];

  const TrajectoryReport same = measured(truth, truth, "fit");
  ASSERT_TRUE(same.body);
  EXPECT_LT(same.body->lever_m, 1e-6);
  EXPECT_LT(same.body->turn_deg, 1e-4);
  EXPECT_LT(same.ate_m.rmse, 1e-6);
}

TEST(EvaluateBody, IsFoundOfACameraThatHardlyTilts) {
  Trajectory truth = path_of(1);
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const double tilt = 1.5 * kDegree * std::sin(0.11 * static_cast<double>(i));
    Rigid3& pose = truth[i].world_from_camera;
    pose.rotation = pose.rotation * geometry::exp_so3({tilt, 0.0, 0.0});
  }
  const TrajectoryReport report = measured(tracked(truth), marker_path(truth), "fit");
  ASSERT_TRUE(report.body);
  const Rigid3 off = marker_from_camera().inverse() * report.body->body_from_camera;
  EXPECT_LT(off.translation.norm(), 0.01);
  EXPECT_LT(geometry::rotation_angle(off.rotation), 0.3 * kDegree);
  EXPECT_LT(report.ate_m.rmse, 1.5 * kNoise_m);
}

TEST(EvaluateBody, IsFoundAmongOutliers) {
  const Trajectory truth = path_of(3);
  Trajectory estimate = tracked(truth);
  for (std::size_t i = 0; i < estimate.size(); i += 12) {
    estimate[i].world_from_camera.translation.x() += 1.0;
    estimate[i].world_from_camera.rotation *= geometry::exp_so3({0.0, 0.0, 1.0});
  }
  const TrajectoryReport report = measured(estimate, marker_path(truth), "fit");
  ASSERT_TRUE(report.body);
  const Rigid3 off = marker_from_camera().inverse() * report.body->body_from_camera;
  EXPECT_LT(off.translation.norm(), 0.003);
  EXPECT_LT(geometry::rotation_angle(off.rotation), 0.2 * kDegree);
}

TEST(EvaluateBody, RefusesMotionThatDoesNotDetermineIt) {
  TrajectoryOptions options;
  options.body = "fit";
  const auto refused = [&](const Trajectory& truth, const char* why) {
    const auto report = evaluate_trajectory(tracked(truth), marker_path(truth), options);
    ASSERT_FALSE(report);
    EXPECT_EQ(report.error().kind, core::ErrorKind::kInput);
    EXPECT_NE(report.error().message.find(why), std::string::npos) << report.error().message;
    EXPECT_NE(report.error().message.find("--body x,y,z"), std::string::npos) << report.error().message;
  };
  refused(path_of(0), "hardly turns");
  refused(path_of(1), "one axis only");
  refused(Trajectory(10, path_of(3)[7]), "hardly turns");

  options.align = TrajectoryAlignment::kStart;
  refused(path_of(3, 1), "hardly turns");
  for (const char* wrong : {"fitt", "1,2,3", "0,0,0,0,0,0,2", "1,2,3,0,0,0,1,", "a,0,0,0,0,0,1"}) {
    options.body = wrong;
    const auto report = evaluate_trajectory(path_of(3), path_of(3), options);
    ASSERT_FALSE(report) << wrong;
    EXPECT_EQ(report.error().kind, core::ErrorKind::kUsage) << wrong;
  }
}

TEST(EvaluateScale, IsToldWithItsUncertainty) {
  const Trajectory truth = path_of(3);
  const TrajectoryReport rigid = measured(tracked(truth), truth);
  const TrajectoryReport report = measured(tracked(truth, 1.05), truth, "", TrajectoryAlignment::kSim3);
  ASSERT_TRUE(report.scale);
  EXPECT_NEAR(report.scale->value, 1.0 / 1.05, 2e-4);
  EXPECT_LT(report.scale->sigma, 5e-4);
  EXPECT_GT(report.scale->sigma, 1e-6);
  EXPECT_NEAR(report.ate_m.rmse, rigid.ate_m.rmse, 1e-5);
  ASSERT_EQ(report.warnings.size(), 1U);
  EXPECT_NE(report.warnings[0].find("5.0"), std::string::npos) << report.warnings[0];
  EXPECT_NE(report.warnings[0].find("too large"), std::string::npos) << report.warnings[0];

  const auto json = nlohmann::json::parse(to_json(report));
  EXPECT_EQ(json["alignment"]["type"], "sim3");
  EXPECT_DOUBLE_EQ(json["alignment"]["scale"].get<double>(), report.scale->value);
  EXPECT_DOUBLE_EQ(json["alignment"]["scale_sigma"].get<double>(), report.scale->sigma);
  EXPECT_NE(to_text(report).find("scale 0.952"), std::string::npos) << to_text(report);
  EXPECT_NE(evaluate::to_text({{"a", report}, {"b", rigid}}).find("0.952"), std::string::npos);
}

TEST(EvaluateScale, OfChanceIsNoWarning) {
  const Trajectory truth = path_of(3);
  const TrajectoryReport report = measured(tracked(truth), truth, "", TrajectoryAlignment::kSim3);
  ASSERT_TRUE(report.scale);
  EXPECT_TRUE(report.scale->doubtful) << report.scale->value << " +- " << report.scale->sigma;
  EXPECT_TRUE(report.warnings.empty()) << report.warnings[0];

  const TrajectoryReport same = measured(truth, truth, "", TrajectoryAlignment::kSim3);
  EXPECT_NEAR(same.scale->value, 1.0, 1e-12);
  EXPECT_TRUE(same.warnings.empty());

  Trajectory still(20, truth[3]);
  for (std::size_t i = 0; i < still.size(); ++i) still[i].stamp += 0.1 * static_cast<double>(i);
  EXPECT_DOUBLE_EQ(measured(still, still, "", TrajectoryAlignment::kSim3).scale->value, 1.0);
}

TEST(EvaluateScale, IsFoundBesideABody) {
  const Trajectory truth = path_of(3);
  const TrajectoryReport report =
      measured(tracked(truth, 1.05), marker_path(truth), "fit", TrajectoryAlignment::kSim3);
  ASSERT_TRUE(report.body);
  expect_marker(report.body->body_from_camera);
  EXPECT_NEAR(report.scale->value, 1.0 / 1.05, 2e-4);
  EXPECT_LT(report.ate_m.rmse, kNoise_m);
}

}  // namespace
