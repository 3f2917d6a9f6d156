// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "../../markup.hpp"
#include "plumbline/viz/trajectory_plots.hpp"

namespace plumbline::viz {
namespace {

using testing_markup::malformed_at;

geometry::Trajectory circle(double radius, std::size_t count) {
  geometry::Trajectory trajectory;
  for (std::size_t i = 0; i < count; ++i) {
    const double angle = 2.0 * M_PI * static_cast<double>(i) / static_cast<double>(count);
    geometry::StampedPose pose;
    pose.stamp = 1.3e9 + 0.1 * static_cast<double>(i);
    pose.world_from_camera = {
        geometry::exp_so3({0.0, 0.0, angle}),
        {radius * std::cos(angle), radius * std::sin(angle), 0.02 * std::sin(5.0 * angle)}};
    trajectory.push_back(pose);
  }
  return trajectory;
}

class TrajectoryPlots : public ::testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::filesystem::path folder_ =
      std::filesystem::path(::testing::TempDir()) /
      (std::string("plumbline_plots_") + ::testing::UnitTest::GetInstance()->current_test_info()->name());
};

TEST_F(TrajectoryPlots, AreAllWritten) {
  TrajectoryComparison comparison;
  comparison.name = "<test> & more";
  comparison.truth = circle(2.0, 80);
  comparison.estimate = circle(2.01, 80);
  const auto done = write_trajectory_plots({comparison}, folder_ / "plots" / "deep");
  ASSERT_TRUE(done.has_value()) << done.error().message;
  for (const std::string name : {"path", "error", "poses", "error_distribution"}) {
    std::ifstream in(folder_ / "plots" / "deep" / (name + ".svg"), std::ios::binary);
    const std::string svg{std::istreambuf_iterator<char>(in), {}};
    EXPECT_EQ(malformed_at(svg), "") << name;
    EXPECT_EQ(svg.find("var("), std::string::npos) << "not every viewer knows variables";
    EXPECT_EQ(svg.find("nan"), std::string::npos);
  }
  EXPECT_TRUE(
      write_trajectory_plots({TrajectoryComparison{"empty", {}, {}, {}, {}}}, folder_ / "empty").has_value());
}

TEST_F(TrajectoryPlots, WrongRequestsAndUnwritableFoldersAreErrors) {
  TrajectoryComparison comparison;
  comparison.truth = circle(2.0, 80);
  comparison.estimate = circle(2.01, 80);
  std::ofstream(folder_ / "file") << "in the way";
  EXPECT_EQ(write_trajectory_plots({comparison}, folder_ / "file" / "sub").error().kind,
            core::ErrorKind::kOutput);
  comparison.truth.pop_back();
  EXPECT_EQ(write_trajectory_plots({comparison}, folder_).error().kind, core::ErrorKind::kUsage);
  EXPECT_EQ(write_trajectory_plots({}, folder_).error().kind, core::ErrorKind::kUsage);
}

TEST(TrajectoryCharts, HoldTheNumbersTheyAreGiven) {
  TrajectoryComparison comparison;
  comparison.truth = circle(2.0, 80);
  comparison.estimate = circle(2.01, 80);
  const std::vector<SvgChart> path = path_charts({comparison});
  ASSERT_EQ(path.size(), 1U);
  EXPECT_TRUE(path[0].equal_aspect);
  EXPECT_EQ(path[0].x_label, "x (m)");
  EXPECT_EQ(path[0].y_label, "y (m)");
  const SvgChart error = error_chart({comparison});
  EXPECT_NEAR(error.lines[0].x.back(), 7.9, 1e-6);  // seconds from the start
  EXPECT_EQ(error.lines[1].label, "RMS 10.0 mm");
  const std::vector<SvgChart> poses = pose_charts({comparison});
  ASSERT_EQ(poses.size(), 6U);
  EXPECT_EQ(poses[5].y_label, "yaw (deg)");
  EXPECT_NEAR(poses[5].lines[0].y.back(), 360.0 * 79.0 / 80.0, 1e-6);  // unwrapped
}

TEST(TrajectoryCharts, ThePathIsColouredByError) {
  TrajectoryComparison comparison;
  comparison.truth = circle(2.0, 80);
  comparison.estimate = circle(2.0, 80);
  for (std::size_t i = 40; i < 80; ++i) comparison.estimate[i].world_from_camera.translation.z() += 0.05;
  const std::vector<SvgLine> lines = path_charts({comparison})[0].lines;
  ASSERT_EQ(lines.size(), 6U);  // truth and five classes
  EXPECT_EQ(lines[5].label, "up to 50.0 mm");
  EXPECT_EQ(lines[1].x.size(), 42U) << "a break, forty poses and the way to the next class";
  EXPECT_EQ(lines[5].x.size(), 41U);
  EXPECT_TRUE(lines[3].x.empty());
}

TEST(TrajectoryCharts, SeveralEstimatesShareTheirScale) {
  TrajectoryComparison near;
  near.name = "near";
  near.truth = circle(2.0, 80);
  near.estimate = circle(2.01, 80);
  TrajectoryComparison far = near;
  far.name = "far";
  far.estimate = circle(2.05, 80);
  const std::vector<SvgChart> path = path_charts({near, far});
  ASSERT_EQ(path.size(), 2U);
  EXPECT_EQ(path[1].title, "Path: far");
  EXPECT_EQ(path[0].lines.back().label, "up to 50.0 mm");  // one scale for both
  const SvgChart error = error_chart({near, far});
  ASSERT_EQ(error.lines.size(), 2U);
  EXPECT_EQ(error.lines[1].label, "far: RMS 50.0 mm");
  EXPECT_EQ(pose_charts({near, far})[0].lines.size(), 3U);  // and the truth
  const SvgChart distribution = error_distribution_chart({near, far});
  ASSERT_EQ(distribution.lines.size(), 2U);
  EXPECT_NEAR(distribution.lines[1].x.front(), 50.0, 1e-6);
  EXPECT_EQ(distribution.lines[1].y.back(), 100.0);
}

TEST(TrajectoryCharts, CurvesBreakWhereTrackingWasLost) {
  TrajectoryComparison comparison;
  comparison.whole_truth = circle(2.0, 80);
  comparison.truth = comparison.whole_truth;
  comparison.estimate = circle(2.01, 80);
  comparison.truth.erase(comparison.truth.begin() + 20, comparison.truth.begin() + 40);
  comparison.estimate.erase(comparison.estimate.begin() + 20, comparison.estimate.begin() + 40);
  const SvgChart error = error_chart({comparison});
  ASSERT_EQ(error.lines[0].y.size(), 61U);
  EXPECT_TRUE(std::isnan(error.lines[0].y[20]));
  EXPECT_EQ(path_charts({comparison})[0].lines[0].x.size(), 80U);  // the truth is drawn whole
}

}  // namespace
}  // namespace plumbline::viz
