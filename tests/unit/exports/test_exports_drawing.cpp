// SPDX-License-Identifier: BSD-3-Clause
#include <regex>

#include "exports/export_test.hpp"
#include "plans/drawing.hpp"

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

TEST_F(DrawnTexts, AreReadableInDxfWhereverTheWorldsNorthIs) {
  for (const double turn_rad : {0.0, 62.0 * kDegree, 2.5, -1.0, M_PI}) {
    ASSERT_TRUE(write_dxf(path("a.dxf"), drawing_, Eigen::Rotation2Dd(turn_rad).toRotationMatrix()));
    expect_readable(numbers("a.dxf", "\n  1\n4\\.00\n 50\n([-0-9.]+)\n"));
  }
}

}  // namespace
}  // namespace plumbline::exports
