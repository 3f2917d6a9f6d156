// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>

#include "plumbline/cloud/io/ply.hpp"
#include "plumbline/core/output_file.hpp"

namespace plumbline::cloud {
namespace {

std::filesystem::path ply_file(const std::string& name) {
  return std::filesystem::path(testing::TempDir()) / ("plumbline_ply_" + name);
}

std::string bytes_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::filesystem::path spill_ply(const std::string& name, const std::string& text) {
  const auto file = ply_file(name);
  std::ofstream(file, std::ios::binary) << text;
  return file;
}

PlyData triangle() {
  PlyData data;
  data.comments = {"unit: metre"};
  data.add("x", std::vector<float>{0.0F, 1.5F, 0.0F});
  data.add("y", std::vector<float>{0.0F, 0.0F, -2.25F});
  data.add("z", std::vector<float>{3.0F, 3.0F, 3.0F});
  data.add("visible", std::vector<std::uint8_t>{1, 0, 255});
  data.triangles = {{0, 1, 2}};
  data.edges = {{0, 1}, {1, 2}};
  data.edge_colors = {{255, 0, 0}, {1, 2, 3}};
  return data;
}

TEST(Ply, RoundTripKeepsEverythingAndBytes) {
  const auto file = ply_file("round.ply");
  ASSERT_TRUE(write_ply(file, triangle()));
  const std::string first = bytes_of(file);
  const auto data = read_ply(file);
  ASSERT_TRUE(data) << data.error().message;
  EXPECT_EQ(data->vertex_count, 3U);
  ASSERT_NE(data->floats("y"), nullptr);
  EXPECT_EQ(*data->floats("y"), (std::vector<float>{0.0F, 0.0F, -2.25F}));
  ASSERT_NE(data->bytes("visible"), nullptr);
  EXPECT_EQ(*data->bytes("visible"), (std::vector<std::uint8_t>{1, 0, 255}));
  EXPECT_EQ(data->floats("visible"), nullptr);
  EXPECT_EQ(data->floats("w"), nullptr);
  EXPECT_EQ(data->triangles, triangle().triangles);
  EXPECT_EQ(data->edges, triangle().edges);
  EXPECT_EQ(data->edge_colors, triangle().edge_colors);
  EXPECT_EQ(data->comments, triangle().comments);
  ASSERT_TRUE(write_ply(file, *data));
  EXPECT_EQ(bytes_of(file), first);
}

TEST(Ply, AsciiWithPolygonsUnknownElementsAndCrLf) {
  const auto file =
      spill_ply("ascii.ply",
                "ply\r\nformat ascii 1.0\r\nobj_info x\r\nelement vertex 4\r\nproperty double x\r\n"
                "property float y\r\nproperty list uchar int ring\r\nproperty float z\r\n"
                "element camera 1\r\nproperty float focal\r\nelement face 1\r\n"
                "property list uchar int vertex_index\r\nend_header\r\n"
                "0 0 1 7 1\r\n1 0 0 1\r\n1 +1 2 8 9 1e0\r\n0 1 0 nan\r\n525\r\n4 0 1 2 3");
  const auto data = read_ply(file);
  ASSERT_TRUE(data) << data.error().message;
  EXPECT_EQ(*data->floats("x"), (std::vector<float>{0, 1, 1, 0}));
  EXPECT_TRUE(std::isnan((*data->floats("z"))[3]));
  ASSERT_EQ(data->triangles.size(), 2U);
  EXPECT_EQ(data->triangles[1], (std::array<std::uint32_t, 3>{0, 2, 3}));
}

TEST(Ply, BlanksAtTheEndsOfHeaderLines) {
  const auto data = read_ply(spill_ply("blanks.ply",
                                       "ply \nformat ascii 1.0 \nelement vertex 2 \nproperty float x "
                                       "\nproperty float y\t\nproperty float z \r\n"
                                       "end_header \n0 0 1\n1 0 1\n"));
  ASSERT_TRUE(data) << data.error().message;
  EXPECT_EQ(data->vertex_count, 2U);
  EXPECT_EQ((*data->floats("x"))[1], 1.0F);
}

TEST(Ply, ShiftIsAddedAsDoubles) {
  PlyData data = triangle();
  data.shift = {1000000.0, 0.0, 0.0};
  ASSERT_TRUE(write_ply(ply_file("shifted.ply"), data));
  EXPECT_NE(bytes_of(ply_file("shifted.ply")).find("property double x\nproperty float y\n"),
            std::string::npos);
  const auto rounded = read_ply(ply_file("shifted.ply"));
  ASSERT_TRUE(rounded) << rounded.error().message;
  EXPECT_EQ((*rounded->floats("x"))[1], 1000001.5F);
  EXPECT_EQ(rounded->triangles, data.triangles);
  const auto shifted = read_ply(ply_file("shifted.ply"), true);
  ASSERT_TRUE(shifted);
  EXPECT_EQ(shifted->shift[0] + static_cast<double>((*shifted->floats("x"))[1]), 1000001.5);
}

TEST(Ply, BigEndianAndIntegerProperties) {
  std::string text =
      "ply\nformat binary_big_endian 1.0\nelement vertex 1\nproperty float x\nproperty short y\n"
      "property uint z\nproperty uchar red\nend_header\n";
  text += std::string("\x3f\xc0\x00\x00\xff\xfe\x00\x01\x00\x00\x80", 11);
  const auto data = read_ply(spill_ply("big.ply", text));
  ASSERT_TRUE(data) << data.error().message;
  EXPECT_EQ((*data->floats("x"))[0], 1.5F);
  EXPECT_EQ((*data->floats("y"))[0], -2.0F);
  EXPECT_EQ((*data->floats("z"))[0], 65536.0F);
  EXPECT_EQ((*data->bytes("red"))[0], 128);
}

TEST(Ply, EveryTruncationIsAnErrorThatNamesTheFile) {
  const auto file = ply_file("whole.ply");
  ASSERT_TRUE(write_ply(file, triangle()));
  const std::string whole = bytes_of(file);
  for (std::size_t length = 0; length < whole.size(); ++length) {
    const auto data = read_ply(spill_ply("cut.ply", whole.substr(0, length)));
    ASSERT_FALSE(data) << length;
    EXPECT_EQ(data.error().kind, core::ErrorKind::kInput);
    EXPECT_NE(data.error().message.find("cut.ply"), std::string::npos) << data.error().message;
  }
}

TEST(Ply, HeaderPromisingMoreThanTheFileHoldsIsRefusedBeforeMemoryIsTaken) {
  for (const std::string format : {"ascii", "binary_little_endian"}) {
    const auto data =
        read_ply(spill_ply("promise.ply", "ply\nformat " + format +
                                              " 1.0\nelement vertex 400000000000\nproperty float x\n"
                                              "end_header\n1 2 3\n"));
    ASSERT_FALSE(data);
    EXPECT_NE(data.error().message.find("header promises 400000000000"), std::string::npos)
        << data.error().message;
  }
}

TEST(Ply, BrokenFilesSayWhatIsWrong) {
  const std::string head = "ply\nformat ascii 1.0\n";
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"", "is not a PLY file"},
      {"solid cube\n", "is not a PLY file"},
      {"ply\nelement vertex 0\nend_header\n", "no format line"},
      {"ply\nformat ascii 2.0\nend_header\n", "line 2"},
      {"ply\nformat text 1.0\nend_header\n", "'text'"},
      {head + "element vertex -1\nend_header\n", "line 3"},
      {head + "property float x\nend_header\n", "before the first element"},
      {head + "element vertex 1\nproperty quad x\nend_header\n1\n", "'quad'"},
      {head + "element vertex 1\nproperty float x\nproperty float x\nend_header\n1 1\n", "twice"},
      {head + "element vertex 1\nend_header\n\n", "no properties"},
      {head + "element vertex 1\nproperty float x\nend_header\nabc\n", "'abc' is not a number"},
      {head + "element vertex 1\nproperty float x\nelement face 1\nproperty list uchar int vertex_indices\n"
              "end_header\n1\n3 0 0 1\n",
       "vertex index 1 is not below 1"},
      {head + "element vertex 1\nproperty list float int l\nend_header\n1 1\n", "integer type"},
      {head + "element vertex 2\nproperty list uint int l\nend_header\n4000000000 1\n", "65536"},
  };
  for (const auto& [text, words] : cases) {
    const auto data = read_ply(spill_ply("broken.ply", text));
    ASSERT_FALSE(data) << text;
    EXPECT_NE(data.error().message.find(words), std::string::npos) << data.error().message;
  }
  EXPECT_FALSE(read_ply(ply_file("not_there.ply")));
  EXPECT_FALSE(read_ply(testing::TempDir()));
}

TEST(OutputFile, LeavesTheOldFileWhenNotCommitted) {
  const auto file = spill_ply("kept.txt", "old");
  {
    core::OutputFile out(file);
    out.write("new");
  }
  EXPECT_EQ(bytes_of(file), "old");
  core::OutputFile out(file);
  out.write("new");
  ASSERT_TRUE(out.commit());
  EXPECT_EQ(bytes_of(file), "new");
}

TEST(OutputFile, FullDiskFolderAndMissingFolderAreOutputErrors) {
  PlyData big;
  big.add("x", std::vector<float>(1000));
  for (const std::filesystem::path& file :
       {std::filesystem::path("/dev/full"), ply_file("no_such_folder") / "a.ply",
        std::filesystem::path(testing::TempDir())}) {
    const auto done = write_ply(file, big);
    ASSERT_FALSE(done) << file;
    EXPECT_EQ(done.error().kind, core::ErrorKind::kOutput);
    EXPECT_NE(done.error().message.find(file.string()), std::string::npos) << done.error().message;
  }
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/full"));
}

}  // namespace
}  // namespace plumbline::cloud
