// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <limits>

#include "plumbline/tracking/overlay.hpp"
#include "tracking_world.hpp"

namespace plumbline::tracking {
namespace {

using tests::kTestCamera;

bool greenish(const cv::Vec3b& c) { return c[1] > 180 && c[2] < 120 && c[0] < 120; }
bool reddish(const cv::Vec3b& c) { return c[2] > 180 && c[1] < 120 && c[0] < 120; }
bool violet(const cv::Vec3b& c) { return c[0] > 90 && c[2] > 70 && c[1] < 70; }

template <typename Test>
int count(const cv::Mat& image, const cv::Rect& area, Test test) {
  int n = 0;
  for (int y = area.y; y < area.y + area.height; ++y) {
    for (int x = area.x; x < area.x + area.width; ++x) n += test(image.at<cv::Vec3b>(y, x)) ? 1 : 0;
  }
  return n;
}
cv::Rect around(const Eigen::Vector2d& p, int half) {
  return {static_cast<int>(p.x()) - half, static_cast<int>(p.y()) - half, 2 * half + 1, 2 * half + 1};
}

/// A black picture, one landmark of each kind in front of the camera at the origin.
class Overlay : public testing::Test {
 protected:
  void SetUp() override {
    frame_.index = 7;
    frame_.color = cv::Mat(480, 640, CV_8UC3, cv::Scalar::all(0));
    track_.state = TrackState::kTracked;
  }
  /// A landmark at `pixel`, 2 m away, and the feature that saw it `error` beside.
  void track_point(const Eigen::Vector2d& pixel, const Eigen::Vector2d& error) {
    maps::MapPoint point;
    point.position = kTestCamera.unproject(pixel.x(), pixel.y(), 2.0);
    features::PointFeature f;
    f.pixel = (pixel + error).cast<float>();
    features_.points.push_back(f);
    track_.points.push_back({map_.add_point(0, point), static_cast<int>(features_.points.size()) - 1, 0});
  }
  features::LineFeature line_feature(const Eigen::Vector2d& a, const Eigen::Vector2d& b, bool with_depth) {
    features::LineFeature f;
    f.segment.start = a.cast<float>();
    f.segment.end = b.cast<float>();
    if (with_depth) f.line3 = features::Line3{};
    return f;
  }
  cv::Mat draw() { return draw_overlay(frame_, features_, track_, map_, kTestCamera); }

  sensor::RgbdFrame frame_;
  features::FrameFeatures features_;
  TrackResult track_;
  maps::Map map_;
};

TEST_F(Overlay, ResidualsShowTheirSizeAndDirection) {
  track_point({200.0, 240.0}, {-0.4, 0.0});
  track_point({400.0, 240.0}, {-4.0, 0.0});
  const cv::Mat image = draw();
  ASSERT_EQ(image.type(), CV_8UC3);
  ASSERT_EQ(image.size(), frame_.color.size());
  const cv::Rect small = around({200.0, 240.0}, 40);
  const cv::Rect large = around({400.0, 240.0}, 40);
  EXPECT_GT(count(image, small, greenish), 0);
  EXPECT_EQ(count(image, small, reddish), 0);
  EXPECT_GT(count(image, large, reddish), 30);
  EXPECT_EQ(count(image, large, greenish), 0);
  // From the measured position towards the predicted one, kResidualZoom times as long: 396 + 32.
  EXPECT_TRUE(reddish(image.at<cv::Vec3b>(240, 424)));
  EXPECT_EQ(count(image, {430, 235, 30, 11}, reddish), 0);
  EXPECT_EQ(count(image, {370, 235, 20, 11}, reddish), 0);
}

TEST_F(Overlay, LinesHaveResidualsAtBothEnds) {
  maps::MapLine landmark;  // level, at v = 200
  landmark.start = kTestCamera.unproject(150.0, 200.0, 2.0);
  landmark.end = kTestCamera.unproject(450.0, 200.0, 2.0);
  features_.lines.push_back(
      line_feature({160.0, 200.2}, {440.0, 204.0}, true));  // tilted: 0.2 px and 4 px off
  track_.lines.push_back({map_.add_line(0, landmark), 0, 0});
  const cv::Mat image = draw();
  EXPECT_GT(count(image, around({160.0, 200.0}, 12), greenish), 0);
  EXPECT_EQ(count(image, around({160.0, 200.0}, 12), reddish), 0);
  EXPECT_GT(count(image, around({440.0, 190.0}, 12), reddish), 15);  // upwards, towards the projected line
  EXPECT_GT(image.at<cv::Vec3b>(200, 300)[2], 150) << "projected line";
}

TEST_F(Overlay, UntrackedIsFaintAndFlatLinesHaveTheirColour) {
  features_.lines.push_back(line_feature({100.0, 150.0}, {300.0, 150.0}, true));
  features_.lines.push_back(line_feature({100.0, 300.0}, {300.0, 300.0}, false));
  const cv::Mat image = draw();
  const cv::Vec3b faint = image.at<cv::Vec3b>(150, 200);
  EXPECT_EQ(faint[0], faint[1]);
  EXPECT_GT(faint[0], 30);
  EXPECT_LT(faint[0], 120);
  EXPECT_TRUE(violet(image.at<cv::Vec3b>(300, 200)));
}

TEST_F(Overlay, StateIsWritten) {
  const cv::Mat tracked = draw();
  track_.state = TrackState::kLost;
  track_.degenerate_directions = 2;
  const cv::Mat lost = draw();
  EXPECT_GT(cv::countNonZero(tracked.reshape(1).rowRange(0, 36)), 500);
  EXPECT_EQ(count(tracked, {0, 100, 2, 200}, reddish), 0);
  EXPECT_GT(count(lost, {0, 100, 2, 200}, reddish), 300) << "red frame";
}

TEST_F(Overlay, SameInputSameBytes) {
  track_point({200.0, 240.0}, {1.0, -1.0});
  const cv::Mat a = draw();
  EXPECT_EQ(cv::norm(a, draw(), cv::NORM_INF), 0.0);
  EXPECT_EQ(cv::norm(frame_.color, cv::NORM_INF), 0.0) << "the frame itself is left alone";
}

TEST_F(Overlay, NothingBreaksIt) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  track_point({200.0, 240.0}, {nan, 0.0});
  track_point({1e9, -1e9}, {0.0, 0.0});
  maps::MapPoint behind;
  behind.position = {0.0, 0.0, -1.0};
  features_.points.emplace_back();
  track_.points.push_back({map_.add_point(0, behind), 2, 0});
  features_.points.emplace_back();
  track_.points.push_back({{0, 12345}, 3, 0});  // culled meanwhile
  maps::MapLine line;
  line.start = {-1.0, 0.2, -2.0};
  line.end = {1.0, 0.2, 2.0};  // passes the camera's plane
  features_.lines.push_back(line_feature({10.0, 10.0}, {50.0, nan}, true));
  features_.lines.push_back(line_feature({10.0, 10.0}, {90.0, 90.0}, false));
  track_.lines.push_back({map_.add_line(0, line), 0, 0});
  line.start = line.end = Eigen::Vector3d::Zero();  // no line at all
  track_.lines.push_back({map_.add_line(0, line), 1, 0});
  EXPECT_EQ(draw().size(), frame_.color.size());

  frame_.color = cv::Mat();
  frame_.gray = cv::Mat(480, 640, CV_8UC1, cv::Scalar(80));
  EXPECT_EQ(draw().type(), CV_8UC3);
  frame_.gray = cv::Mat();
  EXPECT_EQ(draw().size(), cv::Size(640, 480));
  frame_.color = cv::Mat(3, 2, CV_8UC3, cv::Scalar::all(10));
  EXPECT_EQ(draw().size(), cv::Size(2, 3));
}

}  // namespace
}  // namespace plumbline::tracking
