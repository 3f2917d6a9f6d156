// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <pcl/io/pcd_io.h>
#include <pcl/io/ply_io.h>

#include <cstring>

#include "plumbline/cloud/cloud_io.hpp"
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
    EXPECT_EQ(a[i].getNormalVector3fMap(), b[i].getNormalVector3fMap());
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

TEST(CloudIo, BrokenFilesSayWhatIsWrong) {
  const std::string fields = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\n";
  const std::vector<std::array<std::string, 3>> cases = {
      {"a.pcd", fields + "POINTS 4000000000\nDATA binary\nabc", "header promises 4000000000 points"},
      {"a.pcd", fields + "POINTS 4000000000\nDATA ascii\n1 2 3\n", "header promises 4000000000 points"},
      {"a.pcd", fields + "POINTS 4000000000\nDATA binary_compressed\nabcdefgh", "header promises"},
      {"a.pcd", fields + "WIDTH 3\nHEIGHT 2\nPOINTS 5\nDATA ascii\n", "is not POINTS 5"},
      {"a.pcd", fields + "POINTS 1\nDATA ascii\n1 2 three\n", "'three' is not a number"},
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
  CloudColumns wrong;
  wrong.confidence.resize(3);
  EXPECT_THROW(write_ply(temp("w.ply"), cloud, wrong), std::invalid_argument);
}

}  // namespace
}  // namespace plumbline::cloud
