// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <regex>
#include <set>
#include <vector>

#include "exports/export_test.hpp"

namespace plumbline::exports {
namespace {

/// Two rooms of 4 x 3 m and 2.5 x 3 m seen from inside, a wall of 12 cm with a door of 0.9 m between them, a
/// cupboard.
class ExportPlan : public ExportTest {
 protected:
  static constexpr float kStep_m = 0.02F;

  void add_wall(const Eigen::Vector2f& from, const Eigen::Vector2f& to, float low, float high) {
    const Eigen::Vector2f along = (to - from).normalized();
    const Eigen::Vector3f normal(-along.y(), along.x(), 0.0F);  // on the left
    for (float s = 0.5F * kStep_m; s < (to - from).norm(); s += kStep_m) {
      for (float z = low + 0.5F * kStep_m; z < high; z += kStep_m) {
        const Eigen::Vector2f at = from + s * along;
        cloud_.push_back(point(at.x(), at.y(), z, normal));
      }
    }
  }
  /// Counter-clockwise, so that normals look inwards; `door`: in the wall at x1 or x0, from y 1 to 1.9.
  void add_room(float x0, float x1, bool door_right, bool door_left) {
    constexpr float kTop_m = 2.6F;
    constexpr float kLintel_m = 2.05F;
    add_wall({x0, 0}, {x1, 0}, 0, kTop_m);
    add_wall({x1, 3}, {x0, 3}, 0, kTop_m);
    const auto side = [&](float x, float a, float b, bool door) {
      const float sign = b > a ? 1.0F : -1.0F;
      if (!door) return add_wall({x, a}, {x, b}, 0, kTop_m);
      const float first = sign > 0 ? 1.0F : 1.9F;
      add_wall({x, a}, {x, first}, 0, kTop_m);
      add_wall({x, first}, {x, first + sign * 0.9F}, kLintel_m, kTop_m);
      add_wall({x, first + sign * 0.9F}, {x, b}, 0, kTop_m);
    };
    side(x1, 0, 3, door_right);
    side(x0, 3, 0, door_left);
  }
  void SetUp() override {
    add_room(0, 4, true, false);
    add_room(4.12F, 6.62F, false, true);
    add_wall({1.8F, 0.5F}, {0.6F, 0.5F}, 0, 1.1F);  // the front of something low
    ASSERT_TRUE(cloud::write_ply(path("cloud.ply"), cloud_));
  }
  [[nodiscard]] static std::multiset<std::string> texts(const std::string& dxf) {
    std::multiset<std::string> found;
    const std::regex text("AcDbText\n 10\n[^A]*?\n  1\n([^\n]*)\n");
    for (std::sregex_iterator it(dxf.begin(), dxf.end(), text), end; it != end; ++it) found.insert((*it)[1]);
    return found;
  }
  /// Ends of the lines of a layer of plan.dxf: x y x y.
  [[nodiscard]] std::vector<std::array<double, 4>> lines(const std::string& layer) const {
    const std::string dxf = bytes("plan.dxf");
    const std::regex line(
        "  8\n" + layer +
        "\n(?:  6\n.*\n)?100\nAcDbLine\n 10\n(.*)\n 20\n(.*)\n 30\n.*\n 11\n(.*)\n 21\n(.*)\n");
    std::vector<std::array<double, 4>> found;
    for (std::sregex_iterator it(dxf.begin(), dxf.end(), line), end; it != end; ++it)
      found.push_back({std::stod((*it)[1]), std::stod((*it)[2]), std::stod((*it)[3]), std::stod((*it)[4])});
    return found;
  }
  static std::size_t count(const std::string& text, const std::string& what) {
    std::size_t n = 0;
    for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++n;
    return n;
  }

  cloud::Cloud cloud_;
};

TEST_F(ExportPlan, FindsWallsDoorsAndRooms) {
  const auto summary = write(request("plan.dxf"));
  ASSERT_TRUE(summary) << summary.error().message;
  ASSERT_FALSE(summary->notes.empty());
  EXPECT_EQ(summary->notes.front(), "8 walls, 1 doors, 2 closed rooms");
  const std::multiset<std::string> found = texts(bytes("plan.dxf"));
  for (const char* length : {"4.000", "3.000", "2.500"}) EXPECT_EQ(found.count(length), 1U) << length;
  EXPECT_EQ(found.count("1: 12.00 m\\U+00B2"), 1U);
  EXPECT_EQ(found.count("2: 7.50 m\\U+00B2"), 1U);
  EXPECT_EQ(found.count("D1"), 2U) << "on the plan and in the table";
}

TEST_F(ExportPlan, FindsTheFloorAndWallsAtLargeCoordinates) {
  for (float x = 0.0F; x < 6.6F; x += 0.04F) {
    for (float y = 0.0F; y < 3.0F; y += 0.04F) cloud_.push_back(point(x, y, 0));
  }
  for (const double height_m : {520.0, 2520.0}) {
    ASSERT_TRUE(cloud::write_ply(path("cloud.ply"), cloud_, {}, Eigen::Vector3d(691000, 5334000, height_m)));
    const auto nothing = write(request("plan.dxf"));
    ASSERT_FALSE(nothing);
    const std::string heights = fmt::format("{:.2f} to {:.2f} m", height_m, height_m + 2.6);
    EXPECT_NE(nothing.error().message.find(heights), std::string::npos) << nothing.error().message;
    EXPECT_NE(nothing.error().message.find("--storey 0"), std::string::npos) << nothing.error().message;

    ExportRequest wanted = request("plan.dxf");
    wanted.options.storey = 0;
    wanted.given = {"storey"};
    const auto summary = write(wanted);
    ASSERT_TRUE(summary) << summary.error().message;
    EXPECT_EQ(summary->notes.front(), "storey 0: 8 walls, 1 doors, 2 closed rooms");
    EXPECT_NE(bytes("plan.dxf").find("691004."), std::string::npos);
  }
}

TEST_F(ExportPlan, ACutAboveTheDoorMeetsItsLintel) {
  ExportRequest wanted = request("plan.svg");
  wanted.options.cut_m = 2.35;
  wanted.given = {"cut"};
  const auto summary = write(wanted);
  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_EQ(summary->notes.front(), "8 walls, 0 doors, 2 closed rooms");
}

TEST_F(ExportPlan, WindowsAndHalfHeightWallsAreCutAtTheCut) {
  constexpr float kSill_m = 0.9F;
  constexpr float kHead_m = 2.2F;
  cloud::Cloud with_window;
  for (const cloud::Point& p : cloud_) {
    const bool pane = p.y == 3.0F && p.x > 1.0F && p.x < 2.5F && p.z > kSill_m && p.z < kHead_m;
    if (!pane) with_window.push_back(p);
  }
  cloud_ = with_window;
  add_wall({1.0F, 1.7F}, {3.0F, 1.7F}, 0, 1.1F);
  add_wall({3.0F, 1.6F}, {1.0F, 1.6F}, 0, 1.1F);
  ASSERT_TRUE(cloud::write_ply(path("cloud.ply"), cloud_));

  const auto note_at = [&](double cut_m) {
    ExportRequest wanted = request("plan.dxf");
    wanted.options.cut_m = cut_m;
    wanted.given = {"cut"};
    const auto summary = write(wanted);
    EXPECT_TRUE(summary) << summary.error().message;
    return summary ? summary->notes.front() : "";
  };
  EXPECT_EQ(note_at(0.6), "10 walls, 1 doors, 2 closed rooms");
  EXPECT_EQ(lines("A-GLAZ").size(), 0U);

  for (const double cut_m : {1.2, 1.9}) {
    EXPECT_EQ(note_at(cut_m), "8 walls, 1 doors, 1 windows or gaps at the cut, 2 closed rooms");
    const std::vector<std::array<double, 4>> windows = lines("A-GLAZ");
    ASSERT_EQ(windows.size(), 1U);
    EXPECT_NEAR(std::max(windows[0][0], windows[0][2]), 2.5, 0.03);
    EXPECT_NEAR(std::min(windows[0][0], windows[0][2]), 1.0, 0.03);
    EXPECT_NEAR(windows[0][1], 3.0, 0.005);
    for (const auto& [x0, y0, x1, y1] : lines("A-WALL")) {
      const bool across = std::abs(y0 - 3.0) < 0.01 && std::abs(y1 - 3.0) < 0.01 && std::min(x0, x1) < 1.7 &&
                          std::max(x0, x1) > 1.8;
      EXPECT_FALSE(across) << "a wall is drawn across the window";
    }
  }
  EXPECT_EQ(note_at(2.35), "8 walls, 0 doors, 2 closed rooms");
}

/// Measure and text of each dimension of a DXF.
std::vector<std::pair<double, std::string>> dimensions_of(const std::string& dxf) {
  std::vector<std::pair<double, std::string>> found;
  const std::regex pattern("AcDbDimension\n[^A]*\n  1\n(.*)\n 71\n5\n 42\n(.*)\n  3\nPLAN\n");
  for (std::sregex_iterator it(dxf.begin(), dxf.end(), pattern), end; it != end; ++it)
    found.emplace_back(std::stod((*it)[2]), (*it)[1]);
  return found;
}

TEST_F(ExportPlan, ASheetHasItsScaleItsTitleBlockAndDimensions) {
  std::ofstream(path("block.yaml")) << "client: Somebody\nSurveyor: Herself\n";
  ExportRequest wanted = request("plan.dxf");
  wanted.options.paper = "A2";
  wanted.options.scale = "1:50";
  wanted.options.title = "Two rooms";
  wanted.options.title_block = path("block.yaml").string();
  wanted.options.decimal = "comma";
  wanted.given = {"paper", "scale", "title", "title_block", "decimal"};
  const auto summary = write(wanted);
  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_EQ(summary->notes.back(), "1:50 on A2");

  const std::string dxf = bytes("plan.dxf");
  const std::multiset<std::string> found = texts(dxf);
  for (const char* text : {"Two rooms", "Somebody", "Herself", "1:50 on A2", "12,00"})
    EXPECT_GE(found.count(text), 1U) << text;
  const auto dimensions = dimensions_of(dxf);
  EXPECT_EQ(count(dxf, "\nDIMENSION\n"), dimensions.size());
  ASSERT_GE(dimensions.size(), 5U) << "lengths and the door's clear width";
  for (auto [measure, text] : dimensions) {
    ASSERT_NE(text.find(','), std::string::npos) << text;
    std::replace(text.begin(), text.end(), ',', '.');
    EXPECT_NEAR(measure, std::stod(text), 5.1e-4);
  }
  EXPECT_TRUE(std::any_of(dimensions.begin(), dimensions.end(),
                          [](const auto& d) { return std::abs(d.first - 0.9) < 0.03; }));
}

TEST_F(ExportPlan, ASheetThatDoesNotFitSaysWhatWould) {
  ExportRequest wanted = request("plan.svg");
  wanted.options.paper = "A4";
  wanted.options.scale = "20";
  wanted.given = {"paper", "scale"};
  const auto nothing = write(wanted);
  ASSERT_FALSE(nothing);
  EXPECT_NE(nothing.error().message.find("which A4 does not hold"), std::string::npos)
      << nothing.error().message;
  wanted.options.scale = "1:many";
  EXPECT_FALSE(write(wanted));
  wanted.options.scale = "auto";
  EXPECT_TRUE(write(wanted));
}

TEST_F(ExportPlan, LayersAreLeftOutInAllFiles) {
  for (const char* form : {"svg", "dxf"}) {
    for (const bool out : {false, true}) {
      ExportRequest wanted = request(std::string("plan.") + form);
      wanted.options.without = out ? "dims,furn" : "none";
      wanted.given = {"without"};
      ASSERT_TRUE(write(wanted));
      EXPECT_EQ(texts(bytes("plan.dxf")).count("4.000") == 0 &&
                    bytes(std::string("plan.") + form).find(">4.000<") == std::string::npos,
                out)
          << form;
    }
  }
  ExportRequest wanted = request("plan.svg");
  wanted.options.without = "doors";
  const auto nothing = write(wanted);
  ASSERT_FALSE(nothing);
  EXPECT_NE(nothing.error().message.find("door"), std::string::npos) << nothing.error().message;
}

TEST_F(ExportPlan, SameCloudSameBytes) {
  for (const char* form : {"svg", "pdf", "dxf"}) {
    ASSERT_TRUE(write(request(std::string("a.") + form)));
    ASSERT_TRUE(write(request(std::string("b.") + form)));
    EXPECT_EQ(bytes(std::string("a.") + form), bytes(std::string("b.") + form)) << form;
    EXPECT_GT(bytes(std::string("a.") + form).size(), 2000U) << form;
  }
}

TEST_F(ExportPlan, ASectionShowsWhatItMeets) {
  ExportRequest wanted = request("section.svg");
  wanted.options.section = {-1.0, 2.5, 5.0, 2.5};
  wanted.given = {"section"};
  const auto summary = write(wanted);
  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_GT(count(bytes("section.svg"), "fill=\"#000000\""), 100U) << "cells of three walls";
  wanted.options.section = {10.0, 10.0, 11.0, 10.0};
  EXPECT_FALSE(write(wanted));
}

TEST_F(ExportPlan, WithoutWallsItSaysSo) {
  ExportRequest wanted = request("plan.svg");
  wanted.options.box = {0.5, 0.4, 0.0, 2.0, 0.6, 3.0};
  wanted.given = {"box"};
  const auto nothing = write(wanted);
  ASSERT_FALSE(nothing);
  EXPECT_NE(nothing.error().message.find("no wall"), std::string::npos) << nothing.error().message;
}

TEST_F(ExportPlan, JsonHoldsWhatIsDrawn) {
  ASSERT_TRUE(write(request("plan.json")));
  const std::string json = bytes("plan.json");
  EXPECT_NE(json.find("\"area_m2\": 12.0"), std::string::npos) << json.substr(0, 400);
  EXPECT_EQ(count(json, "\"closed\": true"), 2U);
  EXPECT_EQ(count(json, "\"kind\": \"door\""), 1U);
  EXPECT_EQ(count(json, "\"thickness_m\": 0.12"), 4U) << "two pieces on each side of the wall with the door";
}

}  // namespace
}  // namespace plumbline::exports
