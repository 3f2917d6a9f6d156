// SPDX-License-Identifier: BSD-3-Clause
#include <nlohmann/json.hpp>

#include "exports/export_test.hpp"

namespace plumbline::exports {
namespace {

class ExportCloud : public ExportTest {
 protected:
  /// Four points in two storeys, with columns.
  void SetUp() override {
    cloud::Cloud cloud;
    cloud.push_back(point(0, 0, 0));
    cloud.push_back(point(1, 0, 0, Eigen::Vector3f::UnitX(), 255));
    cloud.push_back(point(1, 2, 1.5F));
    cloud.push_back(point(-1, 2, 3.25F));
    cloud::CloudColumns columns;
    columns.confidence = {0.25F, 0.5F, 0.75F, 1.0F};
    columns.robot = {0, 1, 2, 3};
    columns.others.push_back({"sigma", {0.001F, 0.002F, 0.003F, 0.004F}});
    ASSERT_TRUE(cloud::write_ply(path("cloud.ply"), cloud, columns));
  }
};

TEST_F(ExportCloud, LasHasTheLayoutOfTheSpecification) {
  ASSERT_TRUE(write(request("out.las")));
  const std::string las = bytes("out.las");
  EXPECT_EQ(las.substr(0, 4), "LASF");
  EXPECT_EQ(at<std::uint16_t>(las, 6), 16) << "WKT bit";
  EXPECT_EQ(las[24], 1);
  EXPECT_EQ(las[25], 4);
  EXPECT_EQ(at<std::uint16_t>(las, 94), 375);
  EXPECT_EQ(las[104], 7);
  EXPECT_EQ(at<std::uint16_t>(las, 105), 36 + 1 + 4 + 4);
  EXPECT_EQ(at<std::uint32_t>(las, 107), 0U) << "legacy count";
  EXPECT_EQ(at<std::uint64_t>(las, 247), 4U);
  const auto points = at<std::uint32_t>(las, 96);
  ASSERT_EQ(las.size(), points + 4 * 45);
  const double offset = at<double>(las, 155);
  const std::size_t second = points + 45;
  EXPECT_NEAR(offset + 1e-4 * at<std::int32_t>(las, second), 1.0, 1e-4);
  EXPECT_EQ(las[second + 14], 0x11) << "return 1 of 1";
  EXPECT_EQ(at<std::uint16_t>(las, second + 30), 255 * 257);
  EXPECT_EQ(las[second + 36], 1) << "robot";
  EXPECT_EQ(at<float>(las, second + 37), 0.5F) << "confidence";
  EXPECT_EQ(at<float>(las, second + 41), 0.002F) << "sigma";
  EXPECT_NEAR(at<double>(las, 179), 1.0, 1e-4) << "largest x";
  EXPECT_NEAR(at<double>(las, 187), -1.0, 1e-4) << "smallest x";
}

TEST_F(ExportCloud, LasHoldsLargeCoordinatesWhole) {
  ExportRequest wanted = request("out.las");
  wanted.options.epsg = 32633;
  wanted.options.origin = {391000.25, 5817000.5, 34.0, 90.0};  // turned clockwise: x looks south
  wanted.given = {"epsg", "origin"};
  ASSERT_TRUE(write(wanted));
  const std::string las = bytes("out.las");
  EXPECT_NE(las.find("UTM zone 33N"), std::string::npos);
  const auto points = at<std::uint32_t>(las, 96);
  const auto place = [&](std::size_t point, int k) {
    return at<double>(las, 155 + 8 * static_cast<std::size_t>(k)) +
           1e-4 * at<std::int32_t>(las, points + 45 * point + 4 * static_cast<std::size_t>(k));
  };
  EXPECT_NEAR(place(1, 0), 391000.25, 2e-4);
  EXPECT_NEAR(place(1, 1), 5817000.5 - 1.0, 2e-4);
  EXPECT_NEAR(place(3, 2), 34.0 + 3.25, 2e-4);
  const auto applied = nlohmann::json::parse(bytes("out.las.georeference.json"));
  EXPECT_EQ(applied["epsg"], 32633);
}

TEST_F(ExportCloud, AnExportWithoutGeoreferenceRemovesThatOfAnEarlierOne) {
  ExportRequest wanted = request("out.las");
  wanted.options.datum = {48.1, 11.5, 30.0};
  wanted.given = {"datum"};
  ASSERT_TRUE(write(wanted));
  ASSERT_TRUE(fs::exists(path("out.las.georeference.json")));
  ASSERT_TRUE(write(request("out.las")));
  EXPECT_FALSE(fs::exists(path("out.las.georeference.json")));
}

TEST_F(ExportCloud, WarnsAboutAnOriginOutsideOfTheSystem) {
  class Warnings : public core::Log {
   public:
    void write(core::LogLevel level, const std::string& message) override {
      if (level == core::LogLevel::kWarning) text += message;
    }
    std::string text;
  };
  ExportRequest wanted = request("out.las");
  wanted.options.epsg = 25832;
  wanted.given = {"epsg", "origin"};
  for (const bool exchanged : {false, true}) {
    Warnings log;
    wanted.options.origin = {691000, 5334000, 520};
    if (exchanged) std::swap(wanted.options.origin[0], wanted.options.origin[1]);
    ASSERT_TRUE(write_export(wanted, executor_, log, nullptr));
    EXPECT_EQ(log.text.find("--origin 5334000,691000: ") != std::string::npos, exchanged) << log.text;
  }
}

TEST_F(ExportCloud, GlbIsYUp) {
  ASSERT_TRUE(write(request("out.glb")));
  const std::string glb = bytes("out.glb");
  ASSERT_EQ(glb.substr(0, 4), "glTF");
  EXPECT_EQ(at<std::uint32_t>(glb, 8), glb.size());
  const auto length = at<std::uint32_t>(glb, 12);
  const auto json = nlohmann::json::parse(glb.substr(20, length));
  EXPECT_EQ(json["accessors"][0]["count"], 4);
  const std::size_t binary = 20 + length + 8;
  EXPECT_EQ(at<float>(glb, binary + 3 * 12 + 4), 3.25F) << "y of the last point is its height";
  EXPECT_EQ(at<float>(glb, binary + 3 * 12 + 8), -2.0F);
  EXPECT_EQ(at<std::uint16_t>(glb, binary + 4 * 12 + 8), 65535) << "255 is full light";
}

TEST_F(ExportCloud, GlbKeepsLargeCoordinates) {
  cloud::Cloud cloud;
  cloud.push_back(point(0, 0, 0));
  cloud.push_back(point(1, 2, 3));
  const Eigen::Vector3d far(391000.0, 5817000.0, 34.0);
  ASSERT_TRUE(cloud::write_ply(path("cloud.ply"), cloud, {}, far));

  ASSERT_TRUE(write(request("out.glb")));

  const std::string glb = bytes("out.glb");
  const auto length = at<std::uint32_t>(glb, 12);
  const auto json = nlohmann::json::parse(glb.substr(20, length));
  const auto moved = json["nodes"][0]["translation"];
  const std::size_t second = 20 + length + 8 + 12;
  EXPECT_NEAR(moved[0].get<double>() + at<float>(glb, second), 391001.0, 1e-6);
  EXPECT_NEAR(moved[1].get<double>() + at<float>(glb, second + 4), 37.0, 1e-6) << "y is up";
  EXPECT_NEAR(moved[2].get<double>() + at<float>(glb, second + 8), -5817002.0, 1e-6);
}

TEST_F(ExportCloud, SaysThatThereIsNoColor) {
  std::ofstream(path("cloud.ply")) << "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty "
                                      "float y\nproperty float z\nend_header\n1 2 3\n";
  for (const char* output : {"out.las", "out.glb", "out.ply", "out.pcd", "out.csv", "out.xyz"}) {
    const auto summary = write(request(output));
    ASSERT_TRUE(summary) << output << ": " << summary.error().message;
    ASSERT_EQ(summary->notes.size(), 1U) << output;
    EXPECT_NE(summary->notes.front().find("no colour"), std::string::npos) << output;
  }
}

TEST_F(ExportCloud, ChoosesAPart) {
  ExportRequest wanted = request("out.csv");
  wanted.options.z = {-0.5, 2.0};
  wanted.options.box = {0.5, -1, -1, 2, 3, 9};
  wanted.given = {"z", "box"};
  ASSERT_TRUE(write(wanted));
  EXPECT_EQ(bytes("out.csv"),
            "x,y,z,red,green,blue,nx,ny,nz,confidence,robot,sigma\n"
            "1.00000,0.00000,0.00000,255,100,50,1.0000,0.0000,0.0000,0.5,1,0.002\n"
            "1.00000,2.00000,1.50000,200,100,50,0.0000,0.0000,1.0000,0.75,2,0.003\n");
  wanted.options.z = {7.0, 8.0};
  const auto nothing = write(wanted);
  ASSERT_FALSE(nothing);
  EXPECT_EQ(nothing.error().kind, core::ErrorKind::kInput);
}

TEST_F(ExportCloud, AsciiIsReadBack) {
  ExportRequest wanted = request("out.ply");
  wanted.options.ascii = true;
  wanted.given = {"ascii"};
  ASSERT_TRUE(write(wanted));
  const auto back = cloud::read_cloud(path("out.ply"));
  ASSERT_TRUE(back) << back.error().message;
  ASSERT_EQ(back->cloud->size(), 4U);
  EXPECT_EQ((*back->cloud)[1].r, 255);
  EXPECT_EQ(back->columns.robot, (std::vector<std::uint8_t>{0, 1, 2, 3}));
  wanted.output = path("out.pcd");
  ASSERT_TRUE(write(wanted));
  const auto pcd = cloud::read_cloud(path("out.pcd"));
  ASSERT_TRUE(pcd) << pcd.error().message;
  EXPECT_EQ((*pcd->cloud)[3].z, 3.25F);
  EXPECT_EQ((*pcd->cloud)[1].r, 255);
}

TEST_F(ExportCloud, SaysWhatACloudHasNot) {
  for (const char* output : {"grid.yaml", "tree.bt"}) {
    const auto wrong = write(request(output));
    ASSERT_FALSE(wrong) << output;
    EXPECT_EQ(wrong.error().kind, core::ErrorKind::kInput) << output;
    EXPECT_NE(wrong.error().message.find("free space"), std::string::npos) << wrong.error().message;
  }
  ExportRequest path_wanted = request("path.tum");
  path_wanted.content = Content::kTrajectory;
  const auto wrong = write(path_wanted);
  ASSERT_FALSE(wrong);
  EXPECT_NE(wrong.error().message.find("no path"), std::string::npos);
}

}  // namespace
}  // namespace plumbline::exports
