// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "line_world.hpp"
#include "plumbline/features/line_border.hpp"
#include "plumbline/features/line_detector.hpp"

namespace plumbline::features {
namespace {

using world::Polygon;

constexpr double kPi = 3.14159265358979;

Polygon turned_square(double cx, double cy, double half, double angle, double gray) {
  Polygon p;
  p.gray = gray;
  for (int k = 0; k < 4; ++k) {
    const double a = angle + kPi / 4.0 + k * kPi / 2.0;
    p.corners.emplace_back(cx + std::sqrt(2.0) * half * std::cos(a),
                           cy + std::sqrt(2.0) * half * std::sin(a));
  }
  return p;
}

struct Case {
  LineMethod method;
  LineScale scale;
};

class EveryDetector : public ::testing::TestWithParam<Case> {
 protected:
  [[nodiscard]] LineDetectorOptions options() const {
    LineDetectorOptions o;
    o.method = GetParam().method;
    o.scale = GetParam().scale;
    return o;
  }
};

TEST_P(EveryDetector, FindsPolygonEdgesToATenthOfAPixelOrSo) {
  // Off the pixel grid by fractions, so that any half-pixel shift shows.
  const std::vector<Polygon> polygons = {turned_square(150.3, 140.7, 70.0, 0.0, 200.0),
                                         turned_square(420.6, 150.2, 80.0, 0.3, 30.0),
                                         turned_square(250.1, 350.9, 75.0, 0.7, 180.0)};
  const cv::Mat clean = world::render(640, 480, 100.0, polygons);
  const cv::Mat image = world::disturb(clean, 2.0, 1.0, 0.0, 5);
  const std::vector<LineSegment> lines = LineDetector(options()).detect(image);
  ASSERT_GE(lines.size(), 12U);
  double sum = 0.0;
  int ends = 0;
  std::vector<double> found(12, 0.0);
  std::vector<double> bias(12, 0.0);
  for (const LineSegment& l : lines) {
    const int edge = world::edge_of(l, polygons, 2.0);
    ASSERT_GE(edge, 0) << "a line where there is no edge: " << l.start.transpose() << " to "
                       << l.end.transpose();
    const Polygon& p = polygons[static_cast<std::size_t>(edge / 4)];
    const Eigen::Vector2d a = p.corners[static_cast<std::size_t>(edge % 4)];
    const Eigen::Vector2d b = p.corners[static_cast<std::size_t>((edge + 1) % 4)];
    for (const Eigen::Vector2f& end : {l.start, l.end}) {
      sum += world::distance(end.cast<double>(), a, b);
      ++ends;
    }
    found[static_cast<std::size_t>(edge)] += static_cast<double>(l.length());
  }
  EXPECT_LT(sum / ends, 0.15);
  for (std::size_t i = 0; i < found.size(); ++i) EXPECT_GT(found[i], 0.85 * 140.0) << "edge " << i;
}

TEST_P(EveryDetector, PutsTheDarkerSideOnTheRight) {
  const std::vector<Polygon> polygons = {turned_square(200.0, 200.0, 90.0, 0.2, 220.0),
                                         turned_square(450.0, 280.0, 90.0, 1.1, 20.0)};
  const std::vector<LineSegment> lines =
      LineDetector(options()).detect(world::render(640, 480, 120.0, polygons));
  ASSERT_GE(lines.size(), 8U);
  for (const LineSegment& l : lines) {
    const bool bright = l.middle().x() < 325.0F;
    const Eigen::Vector2f centre = bright ? Eigen::Vector2f(200.0F, 200.0F) : Eigen::Vector2f(450.0F, 280.0F);
    const Eigen::Vector2f d = l.direction();
    const Eigen::Vector2f inwards = centre - l.middle();
    const float right = Eigen::Vector2f(-d.y(), d.x()).dot(inwards);
    EXPECT_EQ(right < 0.0F, bright);
    EXPECT_GT(l.response, 10.0F);
  }
}

TEST_P(EveryDetector, TakesDegeneratePictures) {
  const LineDetector detector(options());
  EXPECT_TRUE(detector.detect(cv::Mat()).empty());
  EXPECT_TRUE(detector.detect(cv::Mat(3, 5, CV_8U, cv::Scalar(9))).empty());
  EXPECT_TRUE(detector.detect(cv::Mat(1, 640, CV_8U, cv::Scalar(9))).empty());
  EXPECT_TRUE(detector.detect(cv::Mat(33, 35, CV_8U, cv::Scalar(9))).empty());
  EXPECT_TRUE(detector.detect(cv::Mat(480, 640, CV_8U, cv::Scalar(0))).empty());
  EXPECT_TRUE(detector.detect(cv::Mat(479, 641, CV_8U, cv::Scalar(255))).empty());
}

TEST_P(EveryDetector, GivesTheSameBytesInAFixedOrder) {
  const cv::Mat image =
      world::disturb(world::render(320, 240, 90.0, world::clutter(20, 320, 240, 3)), 3.0, 1.0, 0.0, 1);
  LineDetectorOptions o = options();
  const std::vector<LineSegment> first = LineDetector(o).detect(image);
  const std::vector<LineSegment> again = LineDetector(o).detect(image.clone());
  ASSERT_GT(first.size(), 5U);
  ASSERT_EQ(first.size(), again.size());
  for (std::size_t i = 0; i < first.size(); ++i) {
    EXPECT_EQ(first[i].start, again[i].start);
    EXPECT_EQ(first[i].end, again[i].end);
    EXPECT_GE(first[i == 0 ? 0 : i - 1].length(), first[i].length() - 1e-3F);
    EXPECT_GE(first[i].length(), 25.0F);
  }
  o.max_count = 5;
  const std::vector<LineSegment> few = LineDetector(o).detect(image);
  ASSERT_EQ(few.size(), 5U);
  for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(few[i].start, first[i].start);
}

TEST_P(EveryDetector, IgnoresABlackFrame) {
  const std::vector<Polygon> polygons = {turned_square(300.0, 240.0, 90.0, 0.3, 200.0)};
  cv::Mat image = world::disturb(world::render(640, 480, 120.0, polygons), 2.0, 1.0, 0.0, 7);
  image.colRange(637, 640).setTo(0);
  image.rowRange(478, 480).setTo(0);
  LineDetectorOptions o = options();
  for (const LineSegment& l : LineDetector(o).detect(image)) {
    EXPECT_GE(world::edge_of(l, polygons, 2.0), 0) << l.start.transpose() << " to " << l.end.transpose();
  }
}

INSTANTIATE_TEST_SUITE_P(Line, EveryDetector,
                         ::testing::Values(Case{LineMethod::kLsd, LineScale::kHalf},
                                           Case{LineMethod::kLsd, LineScale::kFull},
                                           Case{LineMethod::kEdlines, LineScale::kHalf},
                                           Case{LineMethod::kEdlines, LineScale::kFull},
                                           Case{LineMethod::kFld, LineScale::kHalf},
                                           Case{LineMethod::kFld, LineScale::kFull}));

TEST(LineDetector, KeepsTheTwoEdgesOfAThinLineApart) {
  Polygon bar;
  bar.gray = 20.0;
  bar.corners = {{100.0, 200.2}, {500.0, 200.2}, {500.0, 205.2}, {100.0, 205.2}};
  const std::vector<LineSegment> lines = LineDetector().detect(world::render(640, 480, 180.0, {bar}));
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_LT(lines[0].direction().dot(lines[1].direction()), -0.99F);
  EXPECT_NEAR(std::abs(lines[0].middle().y() - lines[1].middle().y()), 5.0F, 0.3F);
}

TEST(LineDetector, SeesFaintEdgesWhereThereIsNothingElse) {
  // A white wall's corner: 7 grey levels under a little noise.
  const std::vector<Polygon> wall = {turned_square(320.0, 240.0, 120.0, 0.4, 227.0)};
  const cv::Mat image = world::disturb(world::render(640, 480, 220.0, wall), 0.7, 1.0, 0.0, 3);
  double length = 0.0;
  for (const LineSegment& l : LineDetector().detect(image)) {
    EXPECT_GE(world::edge_of(l, wall, 2.5), 0);
    length += static_cast<double>(l.length());
  }
  EXPECT_GT(length, 0.6 * 4.0 * 240.0);
  LineDetectorOptions published;
  published.min_gradient = 5.2;
  double strong = 0.0;
  for (const LineSegment& l : LineDetector(published).detect(image))
    strong += static_cast<double>(l.length());
  EXPECT_LT(strong, 0.5 * length);
}

TEST(LineDetector, WallsThatDarkenTowardsACornerHardlyPullItsEdge) {
  // As a corner of a room looks from afar: white falls by 1.5 levels a pixel before the step of 20, green
  // rises by 1.8 behind it. By the centroid of all steps the edge would lie 1.2 px within the white.
  constexpr double kSlant = 0.01;
  for (const double corner : {300.0, 300.25, 300.5, 300.75}) {
    const auto edge_at = [&](double y) { return corner + kSlant * (y - 240.0); };
    cv::Mat clean(480, 640, CV_8U);
    for (int y = 0; y < clean.rows; ++y) {
      for (int x = 0; x < clean.cols; ++x) {
        double sum = 0.0;
        for (int k = 0; k < 16; ++k) {
          const double d = x + (k + 0.5) / 16.0 - 0.5 - edge_at(y);
          sum += d < 0.0 ? 160.0 - 1.5 * std::max(d, -12.0) : 140.0 + 1.8 * std::min(d, 12.0);
        }
        clean.at<unsigned char>(y, x) = static_cast<unsigned char>(std::lround(sum / 16.0));
      }
    }
    int near = 0;
    for (const LineSegment& l : LineDetector().detect(world::disturb(clean, 0.7, 1.0, 0.0, 4))) {
      const double off = static_cast<double>(l.middle().x()) - edge_at(static_cast<double>(l.middle().y()));
      if (std::abs(off) > 3.0 || l.end.y() > l.start.y()) continue;  // a fold of the wall; or its other side
      EXPECT_NEAR(off, 0.0, 0.6) << corner;
      ++near;
    }
    EXPECT_GT(near, 0);
  }
}

TEST(LineDetector, FindsNoLinesInNoise) {
  for (const double sigma : {2.0, 6.0, 15.0}) {
    const cv::Mat image = world::disturb(cv::Mat(480, 640, CV_8U, cv::Scalar(128)), sigma, 1.0, 0.0, 11);
    EXPECT_TRUE(LineDetector().detect(image).empty()) << "noise " << sigma;
    LineDetectorOptions exact;
    exact.exact_nfa = true;
    EXPECT_TRUE(LineDetector(exact).detect(image).empty()) << "noise " << sigma;
  }
}

TEST(LineDetector, DropsWhatEndsAtTheBorderWhenAsked) {
  cv::Mat image(480, 640, CV_8U, cv::Scalar(60));
  cv::rectangle(image, cv::Rect(0, 200, 400, 100), cv::Scalar(180), cv::FILLED);  // out of the left side
  LineDetectorOptions options;
  EXPECT_GE(LineDetector(options).detect(image).size(), 3U);
  options.border_either = true;
  for (const LineSegment& l : LineDetector(options).detect(image))
    EXPECT_GT(std::min(l.start.x(), l.end.x()), 300.0F);
}

TEST(LineJoin, JoinsCollinearPiecesAndNothingElse) {
  const LineDetectorOptions o;
  // Two pieces 6 px apart, one of the opposite step, one parallel 5 px beside, one too far along, one turned.
  const std::vector<LineSegment> joined = join_collinear(
      {world::segment(10, 10, 60, 10), world::segment(66, 10.4F, 120, 10.4F), world::segment(120, 11, 12, 11),
       world::segment(10, 15, 120, 15), world::segment(160, 10, 200, 10), world::segment(126, 10, 160, 25)},
      o);
  ASSERT_EQ(joined.size(), 5U);
  EXPECT_NEAR(joined[0].length(), 110.0F, 0.5F);
  EXPECT_NEAR(joined[0].start.x(), 10.0F, 0.2F);
  EXPECT_NEAR(joined[0].end.x(), 120.0F, 0.2F);
}

TEST(LineJoin, ChainsAndDropsNearDuplicates) {
  const LineDetectorOptions o;
  EXPECT_EQ(join_collinear(
                {world::segment(0, 0, 30, 0), world::segment(35, 0, 70, 0), world::segment(75, 0, 110, 0)}, o)
                .size(),
            1U);
  EXPECT_EQ(join_collinear({world::segment(0, 0, 100, 0), world::segment(10, 0.6F, 90, 0.6F)}, o).size(), 1U);
  EXPECT_EQ(join_collinear({world::segment(0, 0, 100, 0), world::segment(10, 1.4F, 90, 1.4F)}, o).size(), 2U);
  EXPECT_TRUE(join_collinear({}, o).empty());
  EXPECT_TRUE(join_collinear({world::segment(5, 5, 5, 5)}, o).empty());
}

TEST(ValidRegion, CutsFramesAndNothingElse) {
  const cv::Mat scene =
      world::disturb(world::render(640, 480, 120.0, world::clutter(40, 640, 480, 2)), 2.0, 1.0, 0.0, 1);
  EXPECT_EQ(valid_region(scene), cv::Rect(0, 0, 640, 480));
  cv::Mat framed = scene.clone();
  framed.colRange(0, 2).setTo(0);
  framed.colRange(637, 640).setTo(0);
  framed.rowRange(475, 480).setTo(0);
  EXPECT_EQ(valid_region(framed), cv::Rect(2, 0, 635, 475));
  // Black in the middle of the side, fading out towards its ends.
  cv::Mat faded = scene.clone();
  for (int x = 0; x < 640; ++x) {
    const double share = std::min(1.0, std::abs(x - 320) / 320.0);
    auto& value = faded.at<unsigned char>(479, x);
    value = static_cast<unsigned char>(share * value);
  }
  EXPECT_EQ(valid_region(faded), cv::Rect(0, 0, 640, 479));
}

TEST(ValidRegion, KeepsDarkWhiteAndDegeneratePictures) {
  EXPECT_EQ(valid_region(cv::Mat(480, 640, CV_8U, cv::Scalar(0))), cv::Rect(0, 0, 640, 480));
  EXPECT_EQ(valid_region(cv::Mat(480, 640, CV_8U, cv::Scalar(255))), cv::Rect(0, 0, 640, 480));
  EXPECT_EQ(valid_region(cv::Mat(3, 3, CV_8U, cv::Scalar(1))), cv::Rect(0, 0, 3, 3));
  EXPECT_EQ(valid_region(cv::Mat()), cv::Rect(0, 0, 0, 0));
  // A night scene: black at the sides, one lit window in the middle.
  const cv::Mat night = world::render(640, 480, 0.0, {turned_square(320.0, 240.0, 60.0, 0.1, 250.0)});
  EXPECT_EQ(valid_region(night), cv::Rect(0, 0, 640, 480));
}

}  // namespace
}  // namespace plumbline::features
