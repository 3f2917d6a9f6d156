// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <opencv2/imgcodecs.hpp>

#include "../../viz/clip_segment.hpp"
#include "../../viz/figure_layout.hpp"
#include "plumbline/viz/figure.hpp"
#include "plumbline/viz/trajectory_plots.hpp"

namespace plumbline::viz {
namespace {

const double kNan = std::nan("");

class FigureTest : public ::testing::Test {
 protected:
  void SetUp() override {
    unsetenv("DISPLAY");
    folder_ =
        std::filesystem::path(::testing::TempDir()) /
        (std::string("plumbline_figure_") + ::testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string bytes(const std::string& name) {
    std::ifstream in(folder_ / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  void write(const Figure& figure, const std::string& name) {
    const auto done = write_figure(figure, folder_, name);
    ASSERT_TRUE(done.has_value()) << done.error().message;
  }
  std::filesystem::path folder_;
};

/// Every element closed in order, one root, no stray '<' or '&'.
bool well_formed(const std::string& xml) {
  std::vector<std::string> open;
  std::size_t roots = 0;
  for (std::size_t at = 0; at < xml.size();) {
    if (xml[at] == '&' && xml.find(';', at) > at + 8) return false;
    if (xml[at] != '<') {
      ++at;
      continue;
    }
    const std::size_t end = xml.find('>', at);
    if (end == std::string::npos) return false;
    const std::string tag = xml.substr(at + 1, end - at - 1);
    at = end + 1;
    if (tag.empty() || tag[0] == '?' || tag[0] == '!') continue;
    const bool closing = tag[0] == '/';
    const std::string name = tag.substr(closing ? 1 : 0, tag.find_first_of(" \n\t/", 1) - (closing ? 1 : 0));
    if (closing) {
      if (open.empty() || open.back() != name) return false;
      open.pop_back();
    } else if (tag.back() != '/') {
      if (open.empty()) ++roots;
      open.push_back(name);
    }
  }
  return open.empty() && roots == 1;
}

int count_near(const cv::Mat& picture, const Rgb& color) {
  int count = 0;
  for (int v = 0; v < picture.rows; ++v) {
    for (int u = 0; u < picture.cols; ++u) {
      const auto bgr = picture.at<cv::Vec3b>(v, u);
      count += std::abs(bgr[0] - color.b) < 12 && std::abs(bgr[1] - color.g) < 12 &&
                       std::abs(bgr[2] - color.r) < 12
                   ? 1
                   : 0;
    }
  }
  return count;
}

Figure small_figure(Axes axes) { return {"", 1, 500, 400, {std::move(axes)}}; }

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

TEST_F(FigureTest, LineIsDrawnWhereItsNumbersSay) {
  Axes axes;
  axes.x_label = "time (s)";
  axes.y_label = "y (m)";
  axes.x_range = {{0.0, 10.0}};
  axes.y_range = {{0.0, 10.0}};
  axes.lines.push_back({"flat", {0.0, 10.0}, {5.0, 5.0}, {220, 0, 0}, 6.0, false});
  axes.lines.push_back({"above the axes", {0.0, 10.0}, {20.0, 20.0}, {0, 0, 220}, 6.0, false});
  write(small_figure(axes), "line");
  const cv::Mat picture = cv::imread((folder_ / "line.png").string());
  ASSERT_EQ(picture.cols, 500);
  ASSERT_EQ(picture.rows, 400);
  EXPECT_EQ(picture.at<cv::Vec3b>(1, 1), cv::Vec3b(255, 255, 255));
  // Plot area: 104 px left, 76 px below, 30 px right, 42 px above.
  const int middle = 400 - 76 - (400 - 76 - 42) / 2;
  const cv::Vec3b on_line = picture.at<cv::Vec3b>(middle, 300);
  EXPECT_GT(on_line[2], 180);
  EXPECT_LT(on_line[1], 40);
  const cv::Mat plot = picture(cv::Rect(106, 44, 360, 278));
  EXPECT_GT(count_near(plot, {220, 0, 0}), 300 * 5);
  EXPECT_EQ(count_near(plot, {0, 0, 220}), 0);
}

TEST_F(FigureTest, PngAndSvgAreWrittenAndTheSame) {
  Axes lines;
  lines.title = "a < b & \"c\"";
  lines.lines.push_back({"x", {0, 1, 2, 3}, {1, kNan, 2, 3}, category_color(0), 2.0, true});
  lines.scatter.push_back({"dots", {0, 1, 2}, {1, 2, 1}, category_color(1), 6.0});
  Axes path;
  path.equal_aspect = true;
  path.colored_paths.push_back({{0, 1, 2}, {0, 1, 0}, {0.1, kNan, 0.3}, "error (m)", {}, 3.0});
  Axes boxes;
  boxes.boxes.push_back({"one", {1, 2, 3, 4, 50}, category_color(0)});
  boxes.boxes.push_back({"none", {}, category_color(1)});
  Axes histogram;
  histogram.histograms.push_back({"h", {1, 1, 2, 5, kNan}, category_color(2)});
  const Figure figure{"Title <&>", 2, 800, 600, {lines, path, boxes, histogram}};
  write(figure, "a");
  write(figure, "b");
  EXPECT_EQ(bytes("a.png"), bytes("b.png"));
  EXPECT_EQ(bytes("a.svg"), bytes("b.svg"));
  EXPECT_GT(bytes("a.png").size(), 5000U);
  EXPECT_GT(bytes("a.svg").size(), 5000U);
  EXPECT_TRUE(well_formed(bytes("a.svg")));
  EXPECT_FALSE(well_formed("<svg><g></svg></g>"));
  EXPECT_FALSE(well_formed("<svg>a & b</svg>"));
  const cv::Mat picture = cv::imread((folder_ / "a.png").string());
  for (std::size_t i = 0; i < 3; ++i) EXPECT_GT(count_near(picture, category_color(i)), 20) << i;
}

TEST_F(FigureTest, NothingToDrawIsStillAFigure) {
  Axes empty;
  Axes nan;
  nan.lines.push_back({"nan", {kNan, kNan}, {kNan, 1.0}});
  Axes constant;
  constant.lines.push_back({"flat", {1.0, 1.0}, {2.0, 2.0}});
  Axes same;
  same.colored_paths.push_back({{0.0, 1.0}, {0.0, 1.0}, {0.0, 0.0}, "error", {}, 3.0});
  same.histograms.push_back({"same", {3.0, 3.0}});
  write({"Empty", 2, 600, 500, {empty, nan, constant, same}}, "empty");
  EXPECT_TRUE(well_formed(bytes("empty.svg")));
  write({"No panels", 1, 200, 100, {}}, "none");
  EXPECT_TRUE(well_formed(bytes("none.svg")));
}

TEST_F(FigureTest, WrongSeriesAreUsageErrors) {
  Axes axes;
  axes.title = "speed";
  axes.lines.push_back({"x", {0, 1, 2}, {1, 2}});
  auto done = write_figure_png(small_figure(axes), folder_ / "a.png");
  ASSERT_FALSE(done.has_value());
  EXPECT_EQ(done.error().kind, core::ErrorKind::kUsage);
  EXPECT_NE(done.error().message.find("speed"), std::string::npos);
  Axes range;
  range.x_range = {{2.0, 1.0}};
  done = write_figure_svg(small_figure(range), folder_ / "a.svg");
  ASSERT_FALSE(done.has_value());
  EXPECT_EQ(done.error().kind, core::ErrorKind::kUsage);
  EXPECT_FALSE(write_figure_png({"", 1, 10, 10, {}}, folder_ / "a.png").has_value());
}

TEST_F(FigureTest, UnwritablePathsAreOutputErrorsThatNameTheFile) {
  const auto png = write_figure_png(small_figure({}), folder_ / "missing" / "a.png");
  ASSERT_FALSE(png.has_value());
  EXPECT_EQ(png.error().kind, core::ErrorKind::kOutput);
  EXPECT_NE(png.error().message.find((folder_ / "missing" / "a.png").string()), std::string::npos);
  const auto svg = write_figure_svg(small_figure({}), folder_ / "missing" / "a.svg");
  ASSERT_FALSE(svg.has_value());
  EXPECT_EQ(svg.error().kind, core::ErrorKind::kOutput);
  EXPECT_NE(svg.error().message.find((folder_ / "missing" / "a.svg").string()), std::string::npos);
  std::ofstream(folder_ / "file") << "in the way";
  const auto folder = write_figure(small_figure({}), folder_ / "file" / "sub", "a");
  ASSERT_FALSE(folder.has_value());
  EXPECT_EQ(folder.error().kind, core::ErrorKind::kOutput);
}

TEST_F(FigureTest, TrajectoryPlotsAreAllWritten) {
  TrajectoryComparison comparison;
  comparison.name = "test";
  comparison.truth = circle(2.0, 80);
  comparison.estimate = circle(2.01, 80);
  const auto done = write_trajectory_plots({comparison}, folder_ / "plots" / "deep");
  ASSERT_TRUE(done.has_value()) << done.error().message;
  for (const std::string name : {"path", "error", "poses", "error_distribution"}) {
    EXPECT_TRUE(well_formed(bytes("plots/deep/" + name + ".svg"))) << name;
    EXPECT_FALSE(cv::imread((folder_ / "plots" / "deep" / (name + ".png")).string()).empty()) << name;
  }
  comparison.truth.pop_back();
  EXPECT_EQ(write_trajectory_plots({comparison}, folder_).error().kind, core::ErrorKind::kUsage);
  EXPECT_EQ(write_trajectory_plots({}, folder_).error().kind, core::ErrorKind::kUsage);
  EXPECT_TRUE(
      write_trajectory_plots({TrajectoryComparison{"empty", {}, {}, {}, {}}}, folder_ / "empty").has_value());
}

TEST(TrajectoryFigures, HoldTheNumbersTheyAreGiven) {
  TrajectoryComparison comparison;
  comparison.truth = circle(2.0, 80);
  comparison.estimate = circle(2.01, 80);
  const Figure path = path_figure({comparison});
  ASSERT_EQ(path.panels.size(), 1U);
  EXPECT_TRUE(path.panels[0].equal_aspect);
  EXPECT_EQ(path.panels[0].x_label, "x (m)");
  EXPECT_EQ(path.panels[0].y_label, "y (m)");
  ASSERT_EQ(path.panels[0].colored_paths.size(), 1U);
  EXPECT_NEAR(path.panels[0].colored_paths[0].value[7], 10.0, 1e-6);  // millimetres
  const Figure error = error_figure({comparison});
  EXPECT_NEAR(error.panels[0].lines[0].x.back(), 7.9, 1e-6);  // seconds from the start
  EXPECT_EQ(error.panels[0].lines[1].label, "RMS 10.0 mm");
  const Figure poses = pose_figure({comparison});
  ASSERT_EQ(poses.panels.size(), 6U);
  const auto& yaw = poses.panels[5].lines[0].y;
  EXPECT_EQ(poses.panels[5].y_label, "yaw (deg)");
  EXPECT_NEAR(yaw.back(), 360.0 * 79.0 / 80.0, 1e-6);  // unwrapped
  const Figure resources = resources_figure({20, 30, 25}, {100, 110, 120});
  ASSERT_EQ(resources.panels.size(), 2U);
  EXPECT_EQ(resources.panels[0].lines[1].label, "median 25.0");
  EXPECT_EQ(resources_figure({}, {}).panels.size(), 1U);
}

TEST(TrajectoryFigures, SeveralEstimatesStandSideBySide) {
  TrajectoryComparison near;
  near.name = "near";
  near.truth = circle(2.0, 80);
  near.estimate = circle(2.01, 80);
  TrajectoryComparison far = near;
  far.name = "far";
  far.estimate = circle(2.05, 80);
  const Figure path = path_figure({near, far});
  ASSERT_EQ(path.panels.size(), 2U);
  EXPECT_EQ(path.panels[1].title, "far");
  ASSERT_TRUE(path.panels[0].colored_paths[0].range.has_value());
  EXPECT_NEAR(path.panels[0].colored_paths[0].range->second, 50.0, 1e-6);  // one scale for both
  const Figure error = error_figure({near, far});
  ASSERT_EQ(error.panels[0].lines.size(), 2U);
  EXPECT_EQ(error.panels[0].lines[1].label, "far: RMS 50.0 mm");
  EXPECT_EQ(pose_figure({near, far}).panels[0].lines.size(), 3U);  // and the truth
  EXPECT_EQ(error_distribution_figure({near, far}).panels[0].boxes.size(), 2U);
}

TEST(TrajectoryFigures, CurvesBreakWhereTrackingWasLost) {
  TrajectoryComparison comparison;
  comparison.whole_truth = circle(2.0, 80);
  comparison.truth = comparison.whole_truth;
  comparison.estimate = circle(2.01, 80);
  comparison.truth.erase(comparison.truth.begin() + 20, comparison.truth.begin() + 40);
  comparison.estimate.erase(comparison.estimate.begin() + 20, comparison.estimate.begin() + 40);
  const Figure error = error_figure({comparison});
  ASSERT_EQ(error.panels[0].lines[0].y.size(), 61U);
  EXPECT_TRUE(std::isnan(error.panels[0].lines[0].y[20]));
  const Figure path = path_figure({comparison});
  EXPECT_TRUE(std::isnan(path.panels[0].colored_paths[0].x[20]));
  EXPECT_EQ(path.panels[0].lines[0].x.size(), 80U);  // the truth is drawn whole
}

TEST(FigureLayout, BoxSummaryFollowsTukey) {
  const BoxSummary box = summarise_box({1, 2, 3, 4, 5, 6, 7, 8, 9, 100, kNan});
  EXPECT_EQ(box.count, 10U);
  EXPECT_DOUBLE_EQ(box.median, 5.5);
  EXPECT_DOUBLE_EQ(box.first_quartile, 3.25);
  EXPECT_DOUBLE_EQ(box.third_quartile, 7.75);
  EXPECT_DOUBLE_EQ(box.low_whisker, 1.0);
  EXPECT_DOUBLE_EQ(box.high_whisker, 9.0);
  EXPECT_EQ(box.outliers, std::vector<double>{100.0});
  EXPECT_EQ(summarise_box({}).count, 0U);
}

TEST(FigureLayout, HistogramCountsEveryFiniteValueOnce) {
  Axes axes;
  axes.histogram_bins = 4;
  axes.histograms.push_back({"a", {0.0, 1.0, 2.0, 3.0, 4.0, kNan}});
  const Bins bins = bin_histograms(axes);
  EXPECT_EQ(bins.counts[0], (std::vector<double>{1, 1, 1, 2}));
}

TEST(FigureLayout, EqualAspectHasEqualPixelsPerUnit) {
  Axes axes;
  axes.equal_aspect = true;
  axes.lines.push_back({"", {0.0, 10.0}, {0.0, 1.0}});
  const PanelLayout layout = lay_out(axes, {0.0, 0.0, 900.0, 700.0});
  EXPECT_NEAR((layout.x.second - layout.x.first) / layout.plot.width,
              (layout.y.second - layout.y.first) / layout.plot.height, 1e-12);
  EXPECT_LE(layout.x.first, 0.0);
  EXPECT_GE(layout.x.second, 10.0);
}

TEST(FigureLayout, TicksAreRoundAndLabelledAlike) {
  const Ticks ticks = nice_ticks(-0.25, 1.0, 0.2);
  EXPECT_EQ(ticks.labels, (std::vector<std::string>{"-0.2", "0.0", "0.2", "0.4", "0.6", "0.8", "1.0"}));
  EXPECT_TRUE(nice_ticks(1.0, 1.0, 0.1).values.empty());
  EXPECT_TRUE(nice_ticks(0.0, kNan, 0.1).values.empty());
}

TEST(FigureLayout, SegmentsAreCutAtTheAxes) {
  const Eigen::Vector2d low(0, 0), high(10, 10);
  Eigen::Vector2d a(-5, 5), b(15, 5);
  ASSERT_TRUE(clip_segment(a, b, low, high));
  EXPECT_EQ(a, Eigen::Vector2d(0, 5));
  EXPECT_EQ(b, Eigen::Vector2d(10, 5));
  a = {-5, 11}, b = {15, 12};
  EXPECT_FALSE(clip_segment(a, b, low, high));
  a = {3, 20}, b = {3, -20};
  ASSERT_TRUE(clip_segment(a, b, low, high));
  EXPECT_EQ(a, Eigen::Vector2d(3, 10));
  EXPECT_EQ(b, Eigen::Vector2d(3, 0));
  a = b = {4, 4};
  EXPECT_TRUE(clip_segment(a, b, low, high));
}

}  // namespace
}  // namespace plumbline::viz
