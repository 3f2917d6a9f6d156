// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <pcl/io/pcd_io.h>
#include <pcl/io/ply_io.h>

#include <cmath>
#include <cstring>
#include <tuple>

#include "plumbline/cloud/io/cloud_io.hpp"
#include "test_cloud_worlds.hpp"

namespace plumbline::cloud {
namespace {

using worlds::point;
using worlds::slurp;

constexpr float kNoNumber = std::numeric_limits<float>::quiet_NaN();

std::filesystem::path temp(const std::string& name) {
  return std::filesystem::path(testing::TempDir()) / ("plumbline_io_" + name);
}

std::filesystem::path spill(const std::string& name, const std::string& text) {
  const auto file = temp(name);
  std::ofstream(file, std::ios::binary) << text;
  return file;
}

Cloud some_points(int count) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform(-3.0F, 3.0F);
  Cloud cloud;
  for (int i = 0; i < count; ++i) {
    Point p = point(uniform(random), uniform(random), uniform(random),
                    Eigen::Vector3f(uniform(random), uniform(random), uniform(random)).normalized());
    p.r = static_cast<std::uint8_t>(i);
    p.g = static_cast<std::uint8_t>(i * 7);
    p.b = static_cast<std::uint8_t>(i * 13);
    p.curvature = 0.25F;
    cloud.push_back(p);
  }
  return cloud;
}

CloudColumns some_columns(std::size_t count) {
  CloudColumns columns;
  for (std::size_t i = 0; i < count; ++i) {
    columns.confidence.push_back(static_cast<float>(i) / 100.0F);
    columns.observations.push_back(static_cast<std::uint32_t>(i * 1000));
    columns.robot.push_back(static_cast<std::uint8_t>(i % 3));
  }
  return columns;
}

void expect_same(const Cloud& a, const Cloud& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].getVector3fMap(), b[i].getVector3fMap());
    const bool unknown = std::isnan(a[i].normal_x) && std::isnan(b[i].normal_x);
    EXPECT_TRUE(unknown || a[i].getNormalVector3fMap() == b[i].getNormalVector3fMap()) << i;
    EXPECT_EQ(a[i].r, b[i].r);
    EXPECT_EQ(a[i].g, b[i].g);
    EXPECT_EQ(a[i].b, b[i].b);
  }
}

TEST(CloudIo, RoundTripKeepsPointsColumnsAndBytes) {
  const Cloud cloud = some_points(100);
  const CloudColumns columns = some_columns(100);
  for (const std::string ending : {".ply", ".pcd"}) {
    const auto file = temp("round" + ending);
    ASSERT_TRUE(write_cloud(file, cloud, columns));
    const std::string first = slurp(file);
    const auto read = read_cloud(file);
    ASSERT_TRUE(read) << read.error().message;
    expect_same(*read->cloud, cloud);
    EXPECT_TRUE(read->has_color);
    EXPECT_TRUE(read->has_normals);
    EXPECT_EQ(read->nan_points, 0U);
    EXPECT_EQ(read->columns.confidence, columns.confidence);
    EXPECT_EQ(read->columns.observations, columns.observations);
    EXPECT_EQ(read->columns.robot, columns.robot);
    ASSERT_TRUE(write_cloud(file, *read->cloud, read->columns));
    EXPECT_EQ(slurp(file), first) << ending;
  }
}

/// x y z of all points as doubles, of a binary PLY as write_ply makes it with a shift.
std::vector<Eigen::Vector3d> double_positions(const std::filesystem::path& file) {
  const std::string bytes = slurp(file);
  EXPECT_NE(bytes.find("property double x\nproperty double y\nproperty double z\n"), std::string::npos);
  const std::size_t record = 3 * sizeof(double) + 3 * sizeof(float) + 3;
  std::vector<Eigen::Vector3d> points;
  const std::size_t begin = bytes.find("end_header\n") + 11;
  for (std::size_t at = begin; at + record <= bytes.size(); at += record) {
    points.emplace_back();
    std::memcpy(points.back().data(), bytes.data() + at, 3 * sizeof(double));
  }
  return points;
}

const char* const kUtmPoints =
    "701362.56 4485513.72 100.00\n701362.57 4485513.72 100.00\n701362.56 4485513.73 100.00\n701362.57 "
    "4485513.73 "
    "100.01\n";

TEST(CloudIo, LargeCoordinatesKeepTheirDigitsByAShift) {
  const std::string points = kUtmPoints;
  const std::string ply_header =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty double y\nproperty double "
      "z\nend_header\n";
  const std::string pcd_header =
      "VERSION .7\nFIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 4\nHEIGHT 1\nVIEWPOINT 701360.5 "
      "4485510 2 1 "
      "0 0 0\nPOINTS 4\nDATA ascii\n";
  for (const auto& file : {spill("utm.ply", ply_header + points), spill("utm.pcd", pcd_header + points),
                           spill("utm.xyz", points)}) {
    const auto read = read_cloud(file, LargeCoordinates::kShifted);
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->shift, Eigen::Vector3d(701362, 4485513, 0)) << file;
    const Cloud& cloud = *read->cloud;
    EXPECT_NEAR(cloud[1].x - cloud[0].x, 0.01, 1e-6);
    EXPECT_NEAR(cloud[2].y - cloud[0].y, 0.01, 1e-6);
    EXPECT_NEAR(cloud[3].z - cloud[0].z, 0.01, 1e-5);
    ASSERT_TRUE(write_ply(temp("utm_out.ply"), cloud, read->columns, read->shift));
    const auto written = double_positions(temp("utm_out.ply"));
    ASSERT_EQ(written.size(), 4U);
    EXPECT_EQ(written[0], Eigen::Vector3d(701362.56, 4485513.72, 100.00));  // to the last digit
    EXPECT_EQ(written[3], Eigen::Vector3d(701362.57, 4485513.73, 100.01));
    const auto again = read_cloud(temp("utm_out.ply"), LargeCoordinates::kShifted);
    ASSERT_TRUE(again);
    expect_same(*again->cloud, cloud);
    ASSERT_TRUE(write_pcd(temp("utm_out.pcd"), cloud, read->columns, read->shift));
    const auto pcd = read_cloud(temp("utm_out.pcd"), LargeCoordinates::kShifted);
    ASSERT_TRUE(pcd) << pcd.error().message;
    EXPECT_EQ(pcd->shift, read->shift);
    expect_same(*pcd->cloud, cloud);
    EXPECT_EQ(pcd->cloud->sensor_origin_, cloud.sensor_origin_);
  }
  const auto pcd = read_cloud(temp("utm.pcd"), LargeCoordinates::kShifted);
  EXPECT_EQ(pcd->cloud->sensor_origin_, Eigen::Vector4f(-1.5F, -3.0F, 2.0F, 0.0F));
}

TEST(CloudIo, ShiftOfWholeNumbersAndNoneWhereFloatsHold) {
  const auto whole = read_cloud(
      spill("int.ply",
            "ply\nformat ascii 1.0\nelement vertex 2\nproperty int x\nproperty int y\nproperty int z\n"
            "end_header\n70136256 -448551372 5\n70136257 -448551371 6\n"),
      LargeCoordinates::kShifted);
  ASSERT_TRUE(whole) << whole.error().message;
  EXPECT_EQ(whole->shift.z(), 0.0);
  EXPECT_EQ((*whole->cloud)[1].x - (*whole->cloud)[0].x, 1.0F);
  EXPECT_EQ((*whole->cloud)[1].y - (*whole->cloud)[0].y, 1.0F);
  EXPECT_EQ(whole->shift.y() + static_cast<double>((*whole->cloud)[0].y), -448551372.0);
  const auto room = spill("room.xyz", "1.5 -2.25 3\nnan 1 2\n");
  const auto small = read_cloud(room, LargeCoordinates::kShifted);
  ASSERT_TRUE(small);
  EXPECT_TRUE(small->shift.isZero(0.0));
  EXPECT_EQ((*small->cloud)[0].y, -2.25F);
  EXPECT_EQ(small->nan_points, 1U);
  const auto rounded = read_cloud(spill("rounded.xyz", kUtmPoints));
  ASSERT_TRUE(rounded);
  EXPECT_TRUE(rounded->shift.isZero(0.0));
  EXPECT_EQ((*rounded->cloud)[0].x, 701362.56F);
}

TEST(CloudIo, APathIsNoCloud) {
  const std::string path = "# stamp tx ty tz qx qy qz qw\n1 0 0 1 0 0 0 1\n2 0.5 0 1 0 0.6 0 0.8\n";
  const auto refused = read_cloud(spill("path.txt", path));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, core::ErrorKind::kInput);
  EXPECT_NE(refused.error().message.find("is a path, not a cloud"), std::string::npos);
  EXPECT_TRUE(read_cloud(spill("eight.txt", path + "3 0 0 1 7 0 0 1\n")));
  EXPECT_TRUE(read_cloud(spill("named.csv", "x,y,z,a,b,c,d,e\n0,0,1,0,0,0,0,1\n")));
}

TEST(CloudIo, FloatsHoldNoTwoCloudsFarApart) {
  const Eigen::Vector3d utm(691000, 5334000, 520);
  EXPECT_TRUE(check_one_frame("a.ply", utm, "b.ply", utm + Eigen::Vector3d(9000, 0, 0)));
  const auto apart = check_one_frame("a.ply", Eigen::Vector3d::Zero(), "b.ply", utm);
  ASSERT_FALSE(apart);
  EXPECT_EQ(apart.error().kind, core::ErrorKind::kInput);
  EXPECT_NE(apart.error().message.find("a.ply and b.ply lie 5379 km apart"), std::string::npos)
      << apart.error().message;
}

TEST(CloudIo, ShiftsAreChanged) {
  auto read = read_cloud(spill("change.xyz", kUtmPoints), LargeCoordinates::kShifted);
  ASSERT_TRUE(read);
  change_shift(*read->cloud, read->shift, Eigen::Vector3d(701360, 4485513, 99));
  EXPECT_FLOAT_EQ((*read->cloud)[0].x, 2.56F);
  EXPECT_NEAR((*read->cloud)[3].z, 1.01F, 1e-5);
}

TEST(CloudIo, ColoursAsCloudCompareAndOldPclWriteThem) {
  const auto diffuse = read_cloud(spill(
      "diffuse.ply",
      "ply\nformat ascii 1.0\nobj_info Generated by CloudCompare!\nelement vertex 2\nproperty float "
      "x\nproperty float y\n"
      "property float z\nproperty uchar diffuse_red\nproperty uchar diffuse_green\nproperty uchar "
      "diffuse_blue\n"
      "property list uchar int view\nelement face 0\nproperty list ushort int vertex_indices\nend_header\n"
      "0 0 1 255 0 0 2 1 2\n1 0 1 0 255 0 1 1\n"));
  ASSERT_TRUE(diffuse) << diffuse.error().message;
  ASSERT_EQ(diffuse->cloud->size(), 2U);
  EXPECT_EQ((*diffuse->cloud)[0].r, 255);
  EXPECT_EQ((*diffuse->cloud)[1].g, 255);
  const auto denormal = read_cloud(spill("denormal.pcd",
                                         "VERSION .7\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 "
                                         "1 1 1\nWIDTH 2\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 "
                                         "0\nPOINTS 2\nDATA ascii\n66.873619 -91.371956 773.60254 "
                                         "9.8649324e-039\n0.002329524 -0.04892 1.223 1.648931e-38\n"));
  ASSERT_TRUE(denormal) << denormal.error().message;
  const Cloud& cloud = *denormal->cloud;
  EXPECT_EQ(std::make_tuple(cloud[0].r, cloud[0].g, cloud[0].b), std::make_tuple(107, 107, 107));
  EXPECT_EQ(std::make_tuple(cloud[1].r, cloud[1].g, cloud[1].b), std::make_tuple(179, 141, 125));
}

TEST(CloudIo, ListOfFourThousandMillionItemsIsRefusedAtOnce) {
  const auto hostile = read_cloud(spill("hostile.ply",
                                        "ply\nformat binary_little_endian 1.0\nelement face 1\nproperty list "
                                        "uint32 double vertex_indices\nend_header\n"
                                        "\xFF\xFF\xFF\xFF"));
  ASSERT_FALSE(hostile);
  EXPECT_NE(hostile.error().message.find("65536"), std::string::npos);
}

TEST(CloudIo, PclReadsWhatIsWritten) {
  const Cloud cloud = some_points(50);
  ASSERT_TRUE(write_ply(temp("pcl.ply"), cloud, some_columns(50)));
  ASSERT_TRUE(write_pcd(temp("pcl.pcd"), cloud, some_columns(50)));
  Cloud ply;
  ASSERT_EQ(pcl::io::loadPLYFile(temp("pcl.ply").string(), ply), 0);
  expect_same(ply, cloud);
  Cloud pcd;
  ASSERT_EQ(pcl::io::loadPCDFile(temp("pcl.pcd").string(), pcd), 0);
  expect_same(pcd, cloud);
  EXPECT_EQ(pcd[7].curvature, 0.25F);
}

TEST(CloudIo, ReadsWhatPclWrites) {
  Cloud cloud = some_points(60);
  cloud.width = 10;
  cloud.height = 6;
  cloud.sensor_origin_ = Eigen::Vector4f(1, 2, 3, 0);
  ASSERT_EQ(pcl::io::savePCDFileASCII(temp("a.pcd").string(), cloud), 0);
  ASSERT_EQ(pcl::io::savePCDFileBinary(temp("b.pcd").string(), cloud), 0);
  ASSERT_EQ(pcl::io::savePCDFileBinaryCompressed(temp("c.pcd").string(), cloud), 0);
  ASSERT_EQ(pcl::io::savePLYFileASCII(temp("a.ply").string(), cloud), 0);
  ASSERT_EQ(pcl::io::savePLYFileBinary(temp("b.ply").string(), cloud), 0);
  for (const std::string name : {"a.pcd", "b.pcd", "c.pcd", "a.ply", "b.ply"}) {
    const auto read = read_cloud(temp(name));
    ASSERT_TRUE(read) << read.error().message;
    ASSERT_EQ(read->cloud->size(), 60U) << name;
    EXPECT_TRUE(read->has_color && read->has_normals) << name;
    for (std::size_t i = 0; i < 60; ++i) {
      EXPECT_LT(((*read->cloud)[i].getVector3fMap() - cloud[i].getVector3fMap()).norm(), 1e-5F) << name;
      EXPECT_LT(((*read->cloud)[i].getNormalVector3fMap() - cloud[i].getNormalVector3fMap()).norm(), 1e-5F);
      EXPECT_EQ((*read->cloud)[i].g, cloud[i].g) << name;
    }
    if (name.find("pcd") != std::string::npos) {
      EXPECT_EQ(read->cloud->width, 10U) << name;
      EXPECT_EQ(read->cloud->sensor_origin_.y(), 2.0F) << name;
    }
  }
}

TEST(CloudIo, NanPointsAreLeftOutOrKeptInTheirPlaceAndCounted) {
  Cloud list = some_points(5);
  list[1].x = kNoNumber;
  list[2].normal_y = kNoNumber;
  for (const std::string ending : {".ply", ".pcd"}) {
    ASSERT_TRUE(write_cloud(temp("nan" + ending), list));
    const auto read = read_cloud(temp("nan" + ending));
    ASSERT_TRUE(read);
    EXPECT_EQ(read->cloud->size(), 4U) << ending;
    EXPECT_EQ(read->nan_points, 0U) << ending;
    EXPECT_EQ(read->nan_normals, 1U) << ending;
    EXPECT_TRUE(std::isnan((*read->cloud)[1].normal_x)) << ending;
  }
  Cloud grid = some_points(6);
  grid.width = 3;
  grid.height = 2;
  grid[4].z = kNoNumber;
  ASSERT_TRUE(write_pcd(temp("grid.pcd"), grid));
  const auto read = read_cloud(temp("grid.pcd"));
  ASSERT_TRUE(read);
  EXPECT_EQ(read->cloud->width, 3U);
  EXPECT_EQ(read->nan_points, 1U);
  EXPECT_FALSE(read->cloud->is_dense);
}

TEST(CloudIo, EmptyClouds) {
  for (const std::string ending : {".ply", ".pcd"}) {
    ASSERT_TRUE(write_cloud(temp("empty" + ending), Cloud()));
    const auto read = read_cloud(temp("empty" + ending));
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_TRUE(read->cloud->empty());
  }
}

TEST(CloudIo, EveryTruncationIsAnErrorThatNamesTheFile) {
  const Cloud cloud = some_points(3);
  ASSERT_TRUE(write_ply(temp("t.ply"), cloud));
  ASSERT_TRUE(write_pcd(temp("t.pcd"), cloud));
  ASSERT_EQ(pcl::io::savePCDFileBinaryCompressed(temp("tc.pcd").string(), some_points(40)), 0);
  for (const std::string name : {"t.ply", "t.pcd", "tc.pcd"}) {
    const std::string whole = slurp(temp(name));
    for (std::size_t length = 0; length < whole.size(); length += 7) {
      const auto read = read_cloud(spill("cut_" + name, whole.substr(0, length)));
      ASSERT_FALSE(read) << name << " cut to " << length;
      EXPECT_EQ(read.error().kind, core::ErrorKind::kInput);
      EXPECT_NE(read.error().message.find("cut_" + name), std::string::npos) << read.error().message;
    }
  }
}

/// In the manner of the files that PDAL and PCL test themselves with.
TEST(CloudIo, WhatPdalAndPclTestThemselvesWith) {
  const auto points = [](const std::string& name, const std::string& text) -> std::size_t {
    const auto read = read_cloud(spill(name, text), LargeCoordinates::kShifted);
    EXPECT_TRUE(read) << text << (read ? "" : read.error().message);
    return read ? read->cloud->size() : 0;
  };
  const std::string utm =
      "VERSION 0.7\nFIELDS X Y Z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 1\n"
      "VIEWPOINT 0.0 0.0 0.0 1.0 0.0 0.0 0.0\nPOINTS 2\nDATA ascii\n";
  EXPECT_EQ(points("a.ply",
                   "ply \nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                   "property float z \nend_header\n-1 0 0\n 0 1 0\n 1 0 0 \n"),
            3U);
  EXPECT_EQ(points("a.ply",
                   "ply\nformat ascii 1.0\ncomment VCGLIB generated\nelement vertex 1\nproperty float x\n"
                   "property float y\nproperty float z\nproperty uchar red\nproperty uchar green\n"
                   "property char blue\nproperty int omg\nelement face 0\n"
                   "property list uchar int vertex_indices\nend_header\n-2.6 -13.1 0.006 63 200 64 1234\n"),
            1U);
  EXPECT_EQ(points("a.ply",
                   "ply\nformat ascii 1.0\nelement vertex 4\nproperty float64 x\nproperty float64 y\n"
                   "property float64 z\nelement face 2\nproperty list uint8 uint32 vertex_indices\n"
                   "end_header\n1 1 0\n2 1 0\n1 2 0\n2 2 2\n3 0 1 2\n3 1 2 3\n"),
            4U);
  for (const char* separator : {" ", "\t", ",", ", "}) {
    const std::string s = separator;
    const std::string rows =
        "289814.15" + s + "4320978.61" + s + "170.76\n289814.64" + s + "4320978.84" + s + "170.76\n";
    const auto read = read_cloud(spill("a.pcd", utm + rows), LargeCoordinates::kShifted);
    ASSERT_TRUE(read) << "'" << s << "' " << read.error().message;
    ASSERT_EQ(read->cloud->size(), 2U);
    EXPECT_NEAR((*read->cloud)[1].y + read->shift.y(), 4320978.84, 1e-4) << "'" << s << "'";
  }
  EXPECT_EQ(points("a.pcd",
                   "# .PCD v.5 - Point Cloud Data file format\nVERSION .5\nFIELDS x y z intensity\n"
                   "SIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\nWIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA ascii\n"
                   "-1.05 -0.75 1.5 0\n-1.06 -0.76 1.5 0.0002"),
            2U);
  EXPECT_EQ(points("a.pcd",
                   "VERSION 0.7\nFIELDS x y z _\nSIZE 4 4 4 1\nTYPE F F F U\nCOUNT 1 1 1 4\nWIDTH 2\n"
                   "HEIGHT 1\nPOINTS 2\nDATA ascii\n1 2 3 0 0 0 0\n4 5 6 0 0 0 0\n"),
            2U);
}

TEST(CloudIo, BrokenFilesSayWhatIsWrong) {
  const std::string fields = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\n";
  const std::vector<std::array<std::string, 3>> cases = {
      {"a.pcd", fields + "POINTS 4000000000\nDATA binary\nabc", "header promises 4000000000 points"},
      {"a.pcd", fields + "POINTS 4000000000\nDATA ascii\n1 2 3\n", "header promises 4000000000 points"},
      {"a.pcd", fields + "POINTS 4000000000\nDATA binary_compressed\nabcdefgh", "header promises"},
      {"a.pcd", fields + "WIDTH 3\nHEIGHT 2\nPOINTS 5\nDATA ascii\n", "is not POINTS 5"},
      {"a.pcd", fields + "POINTS 1\nDATA ascii\n1 2 three\n", "'three' is not a number"},
      {"a.pcd", fields + "POINTS 1\nDATA ascii\n1,5 2,5 3,5\n", "decimal comma"},
      {"a.pcd", fields + "POINTS 1\nDATA zip\n1 2 3\n", "'zip'"},
      {"a.pcd", "FIELDS x y\nSIZE 4 4\nTYPE F F\nPOINTS 1\nDATA ascii\n1 2\n", "no x, y and z"},
      {"a.pcd", "FIELDS x y z\nSIZE 4 4\nTYPE F F F\nPOINTS 1\nDATA ascii\n1 2 3\n", "fewer entries"},
      {"a.pcd", "FIELDS x y z\nSIZE 4 4 3\nTYPE F F F\nPOINTS 1\nDATA ascii\n1 2 3\n", "SIZE 3"},
      {"a.pcd", "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 99999999\nPOINTS 1\nDATA ascii\n1", "COUNT"},
      {"a.pcd", "hello\n", "not a PCD header word"},
      {"a.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n",
       "no x, y and z"},
      {"a.csv", "1,2\n3,4\n", "no x, y and z"},
      {"a.csv", "1,2,3\n3,4\n", "line 2: 2 columns"},
      {"a.csv", "x,y,z\n1,2,abc\n", "line 2: 'abc' is not a number"},
      {"a.xyz", "", "holds no points"},
      {"a.xyz", "1,5 2,5 3,5\n", "decimal comma"},
      {"a.las", "", "ending '.las'"},
  };
  for (const auto& [name, text, words] : cases) {
    const auto read = read_cloud(spill(name, text));
    ASSERT_FALSE(read) << text;
    EXPECT_NE(read.error().message.find(words), std::string::npos) << read.error().message;
    EXPECT_EQ(read.error().kind, core::ErrorKind::kInput);
  }
  EXPECT_NE(read_cloud(temp("nowhere.ply")).error().message.find("does not exist"), std::string::npos);
  EXPECT_NE(read_cloud(testing::TempDir()).error().message.find("is a folder"), std::string::npos);
}

TEST(CloudIo, TextInTheCommonLayouts) {
  struct Layout {
    std::string name, text;
    bool color, normals;
  };
  const std::vector<Layout> cases = {
      {"t.xyz", "1 2 3\n4 5 6\n", false, false},
      {"t.xyz", "1 2 3 0 0 -1\n4 5 6 0 1 0\n", false, true},
      {"t.txt", "1;2;3;255;0;10\n4;5;6;1;2;3\n", true, false},
      {"t.asc", "//X Y Z R G B Nx Ny Nz\n1 2 3 255 0 10 0 0 -1\n4 5 6 1 2 3 0 1 0\n", true, true},
      {"t.csv", "id,y,x,z,red,green,blue\n7,2,1,3,255,0,10\n8,5,4,6,1,2,3\n", true, false},
      {"t.pts", "2\n1 2 3 -800 255 0 10\n4 5 6 -700 1 2 3\n", true, false},
      {"t.xyz", "# made by hand\n\n1\t2\t3\r\n4\t5\t6", false, false},
  };
  for (const auto& c : cases) {
    const auto read = read_cloud(spill(c.name, c.text));
    ASSERT_TRUE(read) << c.text << read.error().message;
    ASSERT_EQ(read->cloud->size(), 2U) << c.text;
    const Point& p = (*read->cloud)[0];
    EXPECT_EQ(p.getVector3fMap(), Eigen::Vector3f(1, 2, 3)) << c.text;
    EXPECT_EQ((*read->cloud)[1].getVector3fMap(), Eigen::Vector3f(4, 5, 6)) << c.text;
    EXPECT_EQ(read->has_color, c.color) << c.text;
    EXPECT_EQ(read->has_normals, c.normals) << c.text;
    EXPECT_EQ(p.r, 255) << c.text;
    EXPECT_EQ(p.b, c.color ? 10 : 255) << c.text;
    EXPECT_EQ(std::isnan(p.normal_z), !c.normals) << c.text;
  }
}

TEST(CloudIo, OutputErrorsNameTheFileAndLeaveNothingBehind) {
  const Cloud cloud = some_points(10);
  const auto folder = temp("folder");
  std::filesystem::create_directories(folder);
  for (const std::filesystem::path& file :
       {std::filesystem::path("/dev/full"), temp("none") / "a.ply", folder}) {
    const auto done = write_ply(file, cloud);
    ASSERT_FALSE(done) << file;
    EXPECT_EQ(done.error().kind, core::ErrorKind::kOutput);
    EXPECT_NE(done.error().message.find(file.string()), std::string::npos) << done.error().message;
    EXPECT_FALSE(write_pcd(file, cloud)) << file;
  }
  ASSERT_TRUE(write_ply(folder / "a.ply", cloud));
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder), {}), 1);
  EXPECT_EQ(write_cloud(temp("a.obj"), cloud).error().kind, core::ErrorKind::kUsage);
  EXPECT_TRUE(write_cloud(temp("A.PLY"), cloud));
  CloudColumns wrong;
  wrong.confidence.resize(3);
  EXPECT_THROW(write_ply(temp("w.ply"), cloud, wrong), std::invalid_argument);
}

}  // namespace
}  // namespace plumbline::cloud
