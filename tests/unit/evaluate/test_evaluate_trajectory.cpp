// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>
#include <string>

#include "plumbline/dataset/trajectory_io.hpp"
#include "plumbline/evaluate/trajectory.hpp"

namespace {

using namespace plumbline;
using evaluate::evaluate_trajectory;
using evaluate::TrajectoryAlignment;
using evaluate::TrajectoryOptions;
using geometry::Rigid3;
using geometry::Trajectory;

constexpr double kDegrees = 180.0 / 3.14159265358979323846;

Rigid3 turn_and_shift(const Eigen::Vector3d& axis_angle, const Eigen::Vector3d& shift) {
  return {geometry::exp_so3(axis_angle), shift};
}

/// A winding path at 100 Hz with turning camera.
Trajectory winding_path(int poses, double start = 1000.0, double step = 0.01) {
  Trajectory path;
  for (int i = 0; i < poses; ++i) {
    const double t = step * i;
    path.push_back(
        {start + t, turn_and_shift({0.3 * std::sin(t), 0.2 * t, 0.1 * std::cos(2.0 * t)},
                                   {std::cos(0.7 * t), 0.8 * std::sin(t), 0.3 * std::sin(2.3 * t)})});
  }
  return path;
}

/// Every n-th pose, noise on it, in another world frame.
Trajectory perturbed(const Trajectory& truth, std::size_t every, double noise_m, unsigned seed) {
  std::mt19937 random(seed);
  const auto uniform = [&random] { return 2.0 * static_cast<double>(random()) / 4294967295.0 - 1.0; };
  const Rigid3 other_world = turn_and_shift({0.4, -1.1, 0.7}, {3.0, -2.0, 0.5});
  Trajectory estimate;
  for (std::size_t i = every; i + every < truth.size(); i += every) {
    const double s = 0.37;  // between two poses of the truth
    const double stamp = truth[i].stamp + s * (truth[i + 1].stamp - truth[i].stamp);
    Rigid3 pose = geometry::interpolate(truth[i].world_from_camera, truth[i + 1].world_from_camera, s);
    pose.translation += noise_m * Eigen::Vector3d(uniform(), uniform(), uniform());
    pose.rotation =
        pose.rotation * geometry::exp_so3(0.01 * Eigen::Vector3d(uniform(), uniform(), uniform()));
    estimate.push_back({stamp, other_world * pose});
  }
  return estimate;
}

struct Expected {
  std::size_t matched = 0;
  double rmse = 0.0, mean = 0.0, median = 0.0, min = 0.0, max = 0.0, path = 0.0;
};

/// ATE by another road: a search through the truth, Horn's quaternions.
Expected independent_ate(const Trajectory& estimate, const Trajectory& truth, double max_dt) {
  std::vector<Eigen::Vector3d> p, q;
  for (const auto& e : estimate) {
    for (std::size_t i = 0; i < truth.size(); ++i) {
      if (std::abs(truth[i].stamp - e.stamp) < 1e-6) {
        p.push_back(e.world_from_camera.translation);
        q.push_back(truth[i].world_from_camera.translation);
        break;
      }
      if (i + 1 == truth.size()) break;
      const double a = e.stamp - truth[i].stamp, b = truth[i + 1].stamp - e.stamp;
      if (a <= 0.0 || b < 1e-6) continue;
      if (a + b > 2.0 * max_dt && std::min(a, b) > max_dt) break;
      p.push_back(e.world_from_camera.translation);
      q.push_back(
          (b * truth[i].world_from_camera.translation + a * truth[i + 1].world_from_camera.translation) /
          (a + b));
      break;
    }
  }
  const auto n = static_cast<double>(p.size());
  Eigen::Vector3d cp = Eigen::Vector3d::Zero(), cq = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < p.size(); ++i) cp += p[i] / n, cq += q[i] / n;
  Eigen::Matrix3d s = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < p.size(); ++i) s += (p[i] - cp) * (q[i] - cq).transpose();
  Eigen::Matrix4d h;
  h << s.trace(), s(1, 2) - s(2, 1), s(2, 0) - s(0, 2), s(0, 1) - s(1, 0),  //
      s(1, 2) - s(2, 1), s(0, 0) - s(1, 1) - s(2, 2), s(0, 1) + s(1, 0), s(2, 0) + s(0, 2), s(2, 0) - s(0, 2),
      s(0, 1) + s(1, 0), s(1, 1) - s(0, 0) - s(2, 2), s(1, 2) + s(2, 1), s(0, 1) - s(1, 0), s(2, 0) + s(0, 2),
      s(1, 2) + s(2, 1), s(2, 2) - s(0, 0) - s(1, 1);
  const Eigen::Vector4d v = Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d>(h).eigenvectors().col(3);
  const Eigen::Quaterniond rotation(v(0), v(1), v(2), v(3));
  Expected out;
  out.matched = p.size();
  std::vector<double> errors;
  for (std::size_t i = 0; i < p.size(); ++i) errors.push_back((rotation * (p[i] - cp) + cq - q[i]).norm());
  for (std::size_t i = 0; i + 1 < q.size(); ++i) out.path += (q[i + 1] - q[i]).norm();
  std::sort(errors.begin(), errors.end());
  for (const double e : errors) out.rmse += e * e / n, out.mean += e / n;
  out.rmse = std::sqrt(out.rmse);
  out.median = errors[errors.size() / 2];
  out.min = errors.front();
  out.max = errors.back();
  return out;
}

void expect_agreement(const Trajectory& estimate, const Trajectory& truth) {
  const auto report = evaluate_trajectory(estimate, truth);
  ASSERT_TRUE(report) << report.error().message;
  const Expected expected = independent_ate(estimate, truth, 0.02);
  EXPECT_EQ(report->matched, expected.matched);
  EXPECT_NEAR(report->ate_m.rmse, expected.rmse, 1e-9);
  EXPECT_NEAR(report->ate_m.mean, expected.mean, 1e-9);
  EXPECT_NEAR(report->ate_m.median, expected.median, 1e-9);
  EXPECT_NEAR(report->ate_m.min, expected.min, 1e-9);
  EXPECT_NEAR(report->ate_m.max, expected.max, 1e-9);
  EXPECT_NEAR(report->path_m, expected.path, 1e-9);
  EXPECT_GT(report->ate_m.rmse, 1e-4);  // the comparison is of something
}

TEST(Statistics, OfFourKnownValues) {
  const evaluate::Statistics s = evaluate::summarize({4.0, 1.0, 2.0, 3.0});
  EXPECT_EQ(s.count, 4U);
  EXPECT_DOUBLE_EQ(s.mean, 2.5);
  EXPECT_DOUBLE_EQ(s.sse, 30.0);
  EXPECT_DOUBLE_EQ(s.rmse, std::sqrt(7.5));
  EXPECT_DOUBLE_EQ(s.std, std::sqrt(1.25));
  EXPECT_DOUBLE_EQ(s.median, 3.0);
  EXPECT_DOUBLE_EQ(s.min, 1.0);
  EXPECT_DOUBLE_EQ(s.max, 4.0);
  EXPECT_DOUBLE_EQ(s.p90, 4.0);
}

TEST(Statistics, PercentileByNearestRank) {
  std::vector<double> values;
  for (int i = 10; i >= 1; --i) values.push_back(i);
  EXPECT_DOUBLE_EQ(evaluate::summarize(values).p90, 9.0);
  values.push_back(11.0);
  EXPECT_DOUBLE_EQ(evaluate::summarize(values).p90, 10.0);
  EXPECT_EQ(evaluate::summarize({}).count, 0U);
  EXPECT_DOUBLE_EQ(evaluate::summarize({7.0}).p90, 7.0);
}

TEST(EvaluateTrajectory, TruthInAnotherFrameHasNoError) {
  const Trajectory truth = winding_path(400);
  const Rigid3 other = turn_and_shift({0.5, 0.2, -2.0}, {10.0, 5.0, -3.0});
  Trajectory estimate;
  for (std::size_t i = 0; i < truth.size(); i += 3) {
    estimate.push_back({truth[i].stamp, other * truth[i].world_from_camera});
  }
  const auto report = evaluate_trajectory(estimate, truth);
  ASSERT_TRUE(report);
  EXPECT_EQ(report->matched, estimate.size());
  EXPECT_LT(report->ate_m.max, 1e-9);
  EXPECT_LT(report->rotation_deg.max, 1e-5);
  EXPECT_LT(report->rpe_frame.translation_m.max, 1e-9);
  EXPECT_LT((report->truth_from_estimate * other).translation.norm(), 1e-9);
  EXPECT_TRUE(report->warnings.empty());
}

TEST(EvaluateTrajectory, AgreesWithAnIndependentFormula) {
  const Trajectory truth = winding_path(700);
  for (const unsigned seed : {1U, 2U, 3U}) expect_agreement(perturbed(truth, 4, 0.03, seed), truth);
}

TEST(EvaluateTrajectory, GapsInTheTruthAreNotBridged) {
  Trajectory truth = winding_path(500);
  const Trajectory estimate = perturbed(truth, 2, 0.02, 5);
  truth.erase(truth.begin() + 200, truth.begin() + 300);
  const auto report = evaluate_trajectory(estimate, truth);
  ASSERT_TRUE(report);
  EXPECT_LT(report->matched, estimate.size() - 40);
  expect_agreement(estimate, truth);
}

TEST(EvaluateTrajectory, OffsetWithoutAlignmentIsSeenPerAxis) {
  const Trajectory truth = winding_path(300);
  Trajectory estimate = truth;
  for (auto& pose : estimate) pose.world_from_camera.translation += Eigen::Vector3d(0.03, -0.04, 0.0);
  TrajectoryOptions options;
  options.align = TrajectoryAlignment::kNone;
  const auto report = evaluate_trajectory(estimate, truth, options);
  ASSERT_TRUE(report);
  EXPECT_NEAR(report->ate_m.rmse, 0.05, 1e-12);
  EXPECT_NEAR(report->ate_m.sse, 300 * 0.0025, 1e-9);
  EXPECT_NEAR(report->ate_m.std, 0.0, 1e-9);
  EXPECT_NEAR(report->axis_m[0].mean, 0.03, 1e-12);
  EXPECT_NEAR(report->axis_m[1].mean, 0.04, 1e-12);
  EXPECT_NEAR(report->axis_bias_m[1], -0.04, 1e-12);
  EXPECT_NEAR(report->axis_m[2].max, 0.0, 1e-12);
}

TEST(EvaluateTrajectory, StartAlignmentLeavesTheDriftAtTheEnd) {
  const Trajectory truth = winding_path(301);
  const Rigid3 other = turn_and_shift({0.1, 0.9, 0.3}, {1.0, 2.0, 3.0});
  Trajectory estimate = truth;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    estimate[i].world_from_camera.translation.z() += 0.001 * static_cast<double>(i);
    estimate[i].world_from_camera = other * estimate[i].world_from_camera;
  }
  TrajectoryOptions options;
  options.align = TrajectoryAlignment::kStart;
  const auto report = evaluate_trajectory(estimate, truth, options);
  ASSERT_TRUE(report);
  EXPECT_NEAR(report->poses.front().distance_m, 0.0, 1e-9);
  EXPECT_NEAR(report->poses.back().distance_m, 0.3, 1e-9);
  EXPECT_NEAR(report->ate_m.mean, 0.15, 1e-9);
}

TEST(EvaluateTrajectory, RelativeErrorOfAConstantDrift) {
  // Camera does not turn in truth; the estimate moves 1 mm too far and turns 0.1 degrees about the optical
  // axis.
  Trajectory truth, estimate;
  for (int i = 0; i <= 300; ++i) {
    const double stamp = 50.0 + i / 30.0;
    truth.push_back({stamp, turn_and_shift(Eigen::Vector3d::Zero(), {0.0, 0.0, 0.010 * i})});
    estimate.push_back({stamp, turn_and_shift({0.0, 0.0, i * 0.1 / kDegrees}, {0.0, 0.0, 0.011 * i})});
  }
  TrajectoryOptions options;
  options.align = TrajectoryAlignment::kStart;
  const auto report = evaluate_trajectory(estimate, truth, options);
  ASSERT_TRUE(report);
  EXPECT_EQ(report->rpe_frame.pairs, 300U);
  EXPECT_NEAR(report->rpe_frame.translation_m.rmse, 0.001, 1e-9);
  EXPECT_NEAR(report->rpe_frame.rotation_deg.mean, 0.1, 1e-6);
  EXPECT_EQ(report->rpe_second.pairs, 271U);
  EXPECT_NEAR(report->rpe_second.translation_m.median, 0.030, 1e-9);
  EXPECT_NEAR(report->rpe_second.rotation_deg.max, 3.0, 1e-6);
}

TEST(EvaluateTrajectory, RelativeErrorPerFrameFollowsTheListOfFrames) {
  const Trajectory truth = winding_path(100);
  Trajectory estimate = truth;
  estimate.erase(estimate.begin() + 40, estimate.begin() + 50);
  std::vector<double> frames;
  for (const auto& pose : truth) frames.push_back(pose.stamp);
  EXPECT_EQ(evaluate_trajectory(estimate, truth)->rpe_frame.pairs, 89U);              // bridges the hole
  EXPECT_EQ(evaluate_trajectory(estimate, truth, {}, frames)->rpe_frame.pairs, 88U);  // does not
}

TEST(EvaluateTrajectory, TrackedShareCountsListedFramesWithAPoseOfTheirOwn) {
  const Trajectory truth = winding_path(200);
  Trajectory estimate;
  std::vector<double> frames;
  for (std::size_t i = 0; i < 100; ++i) frames.push_back(truth[i].stamp);
  for (std::size_t i = 20; i < 80; ++i)
    estimate.push_back({truth[i].stamp + 2e-5, truth[i].world_from_camera});
  estimate.push_back(estimate.back());                                         // a double
  estimate.push_back({truth[90].stamp + 0.004, truth[90].world_from_camera});  // of no frame
  frames.push_back(frames.front());                                            // listed twice
  const auto report = evaluate_trajectory(estimate, truth, {}, frames);
  ASSERT_TRUE(report);
  EXPECT_EQ(report->frames.value(), 100U);
  EXPECT_DOUBLE_EQ(report->tracked_percent.value(), 60.0);
  EXPECT_NEAR(report->first_pose_s.value(), 0.2, 1e-9);
  EXPECT_FALSE(report->warnings.empty());
  const auto without = evaluate_trajectory(estimate, truth);
  EXPECT_FALSE(without->tracked_percent);
  EXPECT_NEAR(without->first_pose_s.value(), 0.2, 1e-4);
}

TEST(EvaluateTrajectory, OrderOfThePosesDoesNotMatter) {
  const Trajectory truth = winding_path(300);
  const Trajectory estimate = perturbed(truth, 3, 0.02, 9);
  const Trajectory reversed(estimate.rbegin(), estimate.rend());
  EXPECT_EQ(to_json(*evaluate_trajectory(estimate, truth)), to_json(*evaluate_trajectory(reversed, truth)));
}

TEST(EvaluateTrajectory, PosesThatShareAStampArePairedInTheirOrder) {
  Trajectory path;
  for (int i = 0; i < 3; ++i)
    path.push_back(
        {1604644894.0, Rigid3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(-0.33 * i, 0.03 * i, 0))});
  path.push_back({1604644895.0, Rigid3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 1, 0))});
  const auto itself = evaluate_trajectory(path, path);
  ASSERT_TRUE(itself) << itself.error().message;
  EXPECT_EQ(itself->matched, 4U);
  EXPECT_LT(itself->ate_m.max, 1e-12);

  Trajectory fewer = path;
  fewer.erase(fewer.begin());
  TrajectoryOptions options;
  options.align = TrajectoryAlignment::kNone;
  const auto other = evaluate_trajectory(fewer, path, options);
  ASSERT_TRUE(other) << other.error().message;
  EXPECT_EQ(other->matched, 1U);
  bool said = false;
  for (const std::string& warning : other->warnings)
    said = said || warning.find("share a stamp") != std::string::npos;
  EXPECT_TRUE(said);
  const auto too_few = evaluate_trajectory(fewer, path);
  ASSERT_FALSE(too_few);
  EXPECT_NE(too_few.error().message.find("share a stamp"), std::string::npos);
}

TEST(EvaluateTrajectory, NoOverlapInTimeIsSaidWithBothRanges) {
  const auto report = evaluate_trajectory(winding_path(50, 1000.0), winding_path(50, 2000.0));
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().kind, core::ErrorKind::kInput);
  EXPECT_NE(report.error().message.find("do not overlap in time"), std::string::npos);
  EXPECT_NE(report.error().message.find("1000.0000"), std::string::npos);
  EXPECT_NE(report.error().message.find("2000.0000"), std::string::npos);
}

TEST(EvaluateTrajectory, RefusesWhatCannotBeCompared) {
  const Trajectory truth = winding_path(50);
  EXPECT_EQ(evaluate_trajectory({}, truth).error().kind, core::ErrorKind::kInput);
  EXPECT_EQ(evaluate_trajectory(truth, {}).error().kind, core::ErrorKind::kInput);
  const Trajectory two(truth.begin(), truth.begin() + 2);
  EXPECT_NE(evaluate_trajectory(two, truth).error().message.find("too few poses: the estimate has 2"),
            std::string::npos);
  TrajectoryOptions none;
  none.align = TrajectoryAlignment::kNone;
  EXPECT_TRUE(evaluate_trajectory(two, truth, none));
  Trajectory broken = truth;
  broken[7].world_from_camera.translation.y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(evaluate_trajectory(broken, truth).error().message.find("pose 8"), std::string::npos);
  TrajectoryOptions options;
  options.max_dt_s = 0.0;
  EXPECT_EQ(evaluate_trajectory(truth, truth, options).error().kind, core::ErrorKind::kUsage);
}

TEST(EvaluateTrajectory, WarnsWhenPositionsDoNotFixTheRotation) {
  Trajectory still = winding_path(50);
  for (auto& pose : still) pose.world_from_camera.translation = Eigen::Vector3d(1.0, 2.0, 3.0);
  const auto report = evaluate_trajectory(still, still);
  ASSERT_TRUE(report);
  EXPECT_NEAR(report->ate_m.max, 0.0, 1e-9);
  ASSERT_FALSE(report->warnings.empty());
  EXPECT_NE(report->warnings.front().find("not determined"), std::string::npos);
}

TEST(EvaluateTrajectory, JsonHasTheDocumentedKeys) {
  const Trajectory truth = winding_path(300);
  const Trajectory estimate = perturbed(truth, 3, 0.02, 4);
  const auto report = evaluate_trajectory(estimate, truth, {}, {truth[0].stamp, estimate[0].stamp});
  ASSERT_TRUE(report);
  const auto json = nlohmann::json::parse(to_json(*report));
  for (const char* key : {"rmse", "mean", "median", "min", "max", "sse", "std"}) {
    EXPECT_TRUE(json["ate_m"][key].is_number()) << key;
  }
  EXPECT_DOUBLE_EQ(json["ate_m"]["rmse"].get<double>(), report->ate_m.rmse);
  EXPECT_TRUE(json["rpe"]["per_frame"]["translation_m"]["rmse"].is_number());
  EXPECT_TRUE(json["rpe"]["per_second"]["rotation_deg"]["max"].is_number());
  EXPECT_EQ(json["matched"].get<std::size_t>(), report->matched);
  EXPECT_DOUBLE_EQ(json["tracked_percent"].get<double>(), 50.0);
  EXPECT_NE(to_text(*report).find("ATE"), std::string::npos);
}

TEST(ReadFrameStamps, ReadsAListAndNamesABadLine) {
  const auto file = std::filesystem::temp_directory_path() / "plumbline_frames_list.txt";
  std::ofstream(file) << "# colour\n1.5 rgb/b.png\n\n0.5 rgb/a.png\n";
  const auto stamps = evaluate::read_frame_stamps(file);
  ASSERT_TRUE(stamps);
  EXPECT_EQ(*stamps, (std::vector<double>{0.5, 1.5}));
  std::ofstream(file) << "1.5 rgb/b.png\nframe rgb/a.png\n";
  EXPECT_NE(evaluate::read_frame_stamps(file).error().message.find(":2: 'frame'"), std::string::npos);
  std::ofstream(file) << "# nothing\n";
  EXPECT_EQ(evaluate::read_frame_stamps(file).error().kind, core::ErrorKind::kInput);
  std::filesystem::remove(file);
  EXPECT_EQ(evaluate::read_frame_stamps(file).error().kind, core::ErrorKind::kInput);
}

/// PLUMBLINE_DATA: a folder of TUM-layout recordings. PLUMBLINE_ATE: optionally, another program that is
/// called as `PLUMBLINE_ATE estimate truth --frames list --json` and answers {matched, rmse_m,
/// tracked_percent, ...}.
TEST(EvaluateTrajectory, AgreesOnRealRecordings) {
  const char* data = std::getenv("PLUMBLINE_DATA");
  if (data == nullptr) GTEST_SKIP() << "PLUMBLINE_DATA is not set";
  const char* other = std::getenv("PLUMBLINE_ATE");
  int recordings = 0;
  for (const auto& entry : std::filesystem::directory_iterator(data)) {
    if (!std::filesystem::exists(entry.path() / "groundtruth.txt")) continue;
    SCOPED_TRACE(entry.path().filename().string());
    ++recordings;
    const auto truth = dataset::read_trajectory(entry.path() / "groundtruth.txt");
    const auto frames = evaluate::read_frame_stamps(entry.path() / "rgb.txt");
    ASSERT_TRUE(truth) << truth.error().message;
    ASSERT_TRUE(frames) << frames.error().message;
    Trajectory made = perturbed(*truth, 1, 0.02, 11);
    for (std::size_t i = 0; i < frames->size();
         i += 2) {  // half of the frames have a pose of their own stamp
      if (const auto pose = geometry::pose_at(*truth, (*frames)[i], 0.05)) {
        made.push_back({(*frames)[i],
                        made.front().world_from_camera * truth->front().world_from_camera.inverse() * *pose});
      }
    }
    const auto file = std::filesystem::temp_directory_path() / "plumbline_perturbed.txt";
    ASSERT_TRUE(dataset::write_trajectory(file, made));
    const auto estimate = dataset::read_trajectory(file);
    ASSERT_TRUE(estimate) << estimate.error().message;
    expect_agreement(*estimate, *truth);
    if (other == nullptr) continue;
    const std::string command = std::string(other) + " " + file.string() + " " +
                                (entry.path() / "groundtruth.txt").string() + " --frames " +
                                (entry.path() / "rgb.txt").string() + " --json";
    FILE* pipe = popen(command.c_str(), "r");
    ASSERT_NE(pipe, nullptr);
    std::array<char, 4096> text{};
    const std::size_t length = fread(text.data(), 1, text.size(), pipe);
    ASSERT_EQ(pclose(pipe), 0);
    const auto answer = nlohmann::json::parse(std::string(text.data(), length));
    const auto report = evaluate_trajectory(*estimate, *truth, {}, *frames);
    ASSERT_TRUE(report);
    EXPECT_EQ(answer["matched"].get<std::size_t>(), report->matched);
    EXPECT_EQ(answer["frames"].get<std::size_t>(), report->frames.value());
    EXPECT_NEAR(answer["tracked_percent"].get<double>(), report->tracked_percent.value(), 1e-9);
    EXPECT_NEAR(answer["rmse_m"].get<double>(), report->ate_m.rmse, 1e-6);
    EXPECT_NEAR(answer["mean_m"].get<double>(), report->ate_m.mean, 1e-6);
    EXPECT_NEAR(answer["median_m"].get<double>(), report->ate_m.median, 1e-6);
    EXPECT_NEAR(answer["min_m"].get<double>(), report->ate_m.min, 1e-6);
    EXPECT_NEAR(answer["max_m"].get<double>(), report->ate_m.max, 1e-6);
    EXPECT_NEAR(answer["path_m"].get<double>(), report->path_m, 1e-6);
    std::printf("%s: matched %zu, rmse %.9f against %.9f m, tracked %.4f against %.4f %%\n",
                entry.path().filename().c_str(), report->matched, report->ate_m.rmse,
                answer["rmse_m"].get<double>(), report->tracked_percent.value(),
                answer["tracked_percent"].get<double>());
  }
  EXPECT_GT(recordings, 0);
}

}  // namespace
