// SPDX-License-Identifier: BSD-3-Clause
#include <regex>

#include "drawings/drawing.hpp"
#include "exports/export_test.hpp"

namespace plumbline::exports {
namespace {

constexpr double kDegree = M_PI / 180.0;

TEST(ReadableAngle, IsThatOrTheOppositeOneFromBelowOrFromTheRight) {
  for (int degrees = -720; degrees <= 720; ++degrees) {
    const double angle = readable_angle(degrees * kDegree) / kDegree;
    EXPECT_GT(angle, -88.001) << degrees;
    EXPECT_LE(angle, 92.001) << degrees;
    const double half_turns = (angle - degrees) / 180.0;
    EXPECT_NEAR(half_turns, std::round(half_turns), 1e-9) << degrees;
  }
  EXPECT_NEAR(readable_angle(151.8 * kDegree), -28.2 * kDegree, 1e-12);
}

TEST(ReadableAngle, AllThatIsAboutVerticalIsReadFromTheRight) {
  for (const double degrees : {-90.0, 90.0, -89.9, 90.1, 89.9, -91.0, 270.0, -270.0, -88.5, 91.5}) {
    EXPECT_NEAR(readable_angle(degrees * kDegree), 90.0 * kDegree, 2.0 * kDegree) << degrees;
  }
}

/// A drawing with a text in each direction.
class DrawnTexts : public ExportTest {
 protected:
  void SetUp() override {
    drawing_.add_layer({"dimensions"});
    drawing_.line(0, {0.0, 0.0}, {10.0, 10.0});
    for (int degrees = -180; degrees < 180; degrees += 10)
      drawing_.texts.push_back({0, {5.0, 5.0}, 0.14, degrees * kDegree, "4.00"});
  }
  /// Numbers that a pattern's first group matches.
  [[nodiscard]] std::vector<double> numbers(const std::string& file, const char* pattern) const {
    const std::string text = bytes(file);
    const std::regex regex(pattern);
    std::vector<double> found;
    for (std::sregex_iterator it(text.begin(), text.end(), regex), end; it != end; ++it)
      found.push_back(std::stod((*it)[1]));
    return found;
  }
  void expect_readable(const std::vector<double>& degrees) const {
    ASSERT_EQ(degrees.size(), drawing_.texts.size());
    for (const double angle : degrees) {
      EXPECT_GT(angle, -88.01);
      EXPECT_LE(angle, 92.01);
    }
  }

  Drawing drawing_;
};

TEST_F(DrawnTexts, AreReadableInSvgWhoseAnglesGoDown) {
  ASSERT_TRUE(write_svg(path("a.svg"), drawing_));
  std::vector<double> degrees = numbers("a.svg", "rotate\\(([-0-9.]+)\\)");
  for (double& angle : degrees) angle = -angle;
  expect_readable(degrees);
}

TEST_F(DrawnTexts, AreReadableInDxf) {
  ASSERT_TRUE(write_dxf(path("a.dxf"), drawing_));
  expect_readable(numbers("a.dxf", "\n  1\n4\\.00\n 50\n([-0-9.]+)\n"));
}

TEST_F(DrawnTexts, AreAsWideInSvgAsInDxf) {
  ASSERT_TRUE(write_svg(path("a.svg"), drawing_));
  ASSERT_TRUE(write_dxf(path("a.dxf"), drawing_));
  const double width_m = drawing_.texts[0].width_m();
  EXPECT_GT(width_m, 0.3);
  for (const double width_mm : numbers("a.svg", "textLength=\"([0-9.]+)\""))
    EXPECT_NEAR(width_mm * drawing_.sheet.mm(), width_m, 1e-3);

  const std::string dxf = bytes("a.dxf");
  const std::regex text("AcDbText\n 10\n(.*)\n 20\n(.*)\n 30\n[^A]*\n 11\n(.*)\n 21\n(.*)\n");
  std::size_t found = 0;
  for (std::sregex_iterator it(dxf.begin(), dxf.end(), text), end; it != end; ++it, ++found) {
    const auto value = [&](std::size_t group) { return std::stod((*it)[group]); };
    EXPECT_NEAR(std::hypot(value(3) - value(1), value(4) - value(2)), width_m, 1e-5);
  }
  EXPECT_EQ(found, drawing_.texts.size());
}

TEST(Drawing, LinesEndBeforeTextsWhereTheirLayerSaysSo) {
  Drawing drawing;
  drawing.add_layer({"walls"});
  drawing.add_layer({"furniture", "#909090", 9, 0.13, true});
  for (const std::size_t layer : {0U, 1U}) drawing.line(layer, {-2.0, 0.0}, {2.0, 0.0});
  drawing.lines.push_back({1, {{-3.0, -3.0}, {3.0, -3.0}, {3.0, 3.0}, {-3.0, 3.0}}, true});
  drawing.texts.push_back({0, {0.0, 0.0}, 0.2, 0.5, "4.000"});
  drawing.break_lines();

  ASSERT_EQ(drawing.lines.size(), 4U) << "the line of the walls, two parts of the other, the square";
  EXPECT_EQ(drawing.lines[0].points.size(), 2U);
  EXPECT_LT(drawing.lines[1].points.back().x(), -0.2);
  EXPECT_GT(drawing.lines[2].points.front().x(), 0.2);
  EXPECT_TRUE(drawing.lines[3].closed);
}

TEST(Drawing, HatchingStaysInTheAreaAndOutOfItsHoles) {
  const DrawnArea area{0, {{{0, 0}, {4, 0}, {4, 3}, {0, 3}}, {{1, 1}, {2, 1}, {2, 2}, {1, 2}}}, 0.05};
  double total = 0.0;
  for (const DrawnLine& line : lines_of(area)) {
    const Eigen::Vector2d middle = 0.5 * (line.points[0] + line.points[1]);
    EXPECT_TRUE(middle.x() > 0 && middle.x() < 4 && middle.y() > 0 && middle.y() < 3) << middle.transpose();
    EXPECT_FALSE(middle.x() > 1 && middle.x() < 2 && middle.y() > 1 && middle.y() < 2) << middle.transpose();
    total += (line.points[1] - line.points[0]).norm();
  }
  EXPECT_NEAR(total * area.spacing_m, 11.0, 0.2);
}

}  // namespace
}  // namespace plumbline::exports
