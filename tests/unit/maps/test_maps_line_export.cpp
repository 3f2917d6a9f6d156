// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <limits>

#include "plumbline/cloud/io/ply.hpp"
#include "plumbline/maps/line_export.hpp"

namespace plumbline::maps {
namespace {

TEST(LineExport, EdgesWithColoursAndWithoutBrokenSegments) {
  const auto file = std::filesystem::path(testing::TempDir()) / "plumbline_lines.ply";
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<LineSegment3> segments = {
      {{0, 0, 0}, {1, 0, 0}}, {{0, nan, 0}, {1, 0, 0}}, {{1, 2, 3}, {4, 5, 6}}};
  ASSERT_TRUE(write_lines_ply(file, segments, {{255, 0, 0}, {0, 255, 0}, {0, 0, 255}}));
  const auto ply = cloud::read_ply(file);
  ASSERT_TRUE(ply) << ply.error().message;
  EXPECT_EQ(*ply->floats("x"), (std::vector<float>{0, 1, 1, 4}));
  EXPECT_EQ(*ply->floats("z"), (std::vector<float>{0, 0, 3, 6}));
  EXPECT_EQ(*ply->bytes("blue"), (std::vector<std::uint8_t>{0, 0, 255, 255}));
  ASSERT_EQ(ply->edges.size(), 2U);
  EXPECT_EQ(ply->edges[1], (std::array<std::uint32_t, 2>{2, 3}));
  EXPECT_EQ(ply->edge_colors[0], (std::array<std::uint8_t, 3>{255, 0, 0}));
}

TEST(LineExport, NoLinesAndWrongColours) {
  const auto file = std::filesystem::path(testing::TempDir()) / "plumbline_no_lines.ply";
  ASSERT_TRUE(write_lines_ply(file, {}));
  EXPECT_EQ(cloud::read_ply(file)->vertex_count, 0U);
  EXPECT_FALSE(write_lines_ply(file, {{{0, 0, 0}, {1, 1, 1}}}, {{1, 2, 3}, {4, 5, 6}}));
  EXPECT_EQ(write_lines_ply("/dev/full", {{{0, 0, 0}, {1, 1, 1}}}).error().kind, core::ErrorKind::kOutput);
}

}  // namespace
}  // namespace plumbline::maps
