// SPDX-License-Identifier: BSD-3-Clause
// The calibration of an Azure Kinect against what its SDK made of one.
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "images/azure_kinect.hpp"
#include "test_dataset_world.hpp"

namespace plumbline::dataset {
namespace {

using testing::HasSubstr;

/// A device whose calibration was published together with the SDK's numbers for it
/// (github.com/panispani/3DReconstruct, pointCloudGen/calib.md).
nlohmann::json calibration() {
  const auto camera = [](const char* purpose, const std::vector<double>& parameters,
                         const std::vector<double>& translation) {
    return nlohmann::json{{"Purpose", std::string("CALIBRATION_CameraPurpose") + purpose},
                          {"Intrinsics",
                           {{"ModelType", "CALIBRATION_LensDistortionModelBrownConrady"},
                            {"ModelParameterCount", 14},
                            {"ModelParameters", parameters}}},
                          {"Rt", {{"Rotation", {1, 0, 0, 0, 1, 0, 0, 0, 1}}, {"Translation", translation}}}};
  };
  const std::vector<double> depth = {0.5122697949409485,
                                     0.49451231956481934,
                                     0.4921168386936188,
                                     0.4921667277812958,
                                     3.1305770874023438,
                                     2.324939012527466,
                                     0.1304156482219696,
                                     3.458651542663574,
                                     3.350114583969116,
                                     0.6629416346549988,
                                     0,
                                     0,
                                     -0.0000511557373101823,
                                     0.00008132171933539212};
  const std::vector<double> color = {0.4967627227306366,
                                     0.5108628273010254,
                                     0.470907062292099,
                                     0.6274453997612,
                                     0.7227460145950317,
                                     -2.8855903148651123,
                                     1.6327226161956787,
                                     0.6021990180015564,
                                     -2.7196261882781982,
                                     1.565053105354309,
                                     0,
                                     0,
                                     -0.0001431911950930953,
                                     0.0007828465895727277};
  return {{"CalibrationInformation",
           {{"Cameras",
             {camera("Depth", depth, {0, 0, 0}), camera("PhotoVideo", color, {-0.032, -0.002, 0.004})}}}}};
}

TEST(AzureKinect, CameraIsThatOfTheSdk) {
  const auto camera = azure_kinect_camera(calibration().dump(), "NFOV_UNBINNED", 1080);
  ASSERT_TRUE(camera) << camera.error().message;
  const sensor::Pinhole& d = *camera->depth;
  EXPECT_EQ(d.width, 640);
  EXPECT_EQ(d.height, 576);
  EXPECT_NEAR(d.cx, 332.064270, 1e-4);
  EXPECT_NEAR(d.cy, 325.880615, 1e-4);
  EXPECT_NEAR(d.fx, 503.927643, 1e-4);
  EXPECT_NEAR(d.fy, 503.978729, 1e-4);
  const sensor::Pinhole& c = camera->color;
  EXPECT_EQ(c.width, 1920);
  EXPECT_NEAR(c.cx, 953.284424, 1e-4);
  EXPECT_NEAR(c.cy, 555.142456, 1e-4);
  EXPECT_NEAR(c.fx, 904.141541, 1e-4);
  EXPECT_NEAR(c.fy, 903.521362, 1e-4);
  EXPECT_NEAR(camera->depth_lens.k[2], 0.000081, 1e-6) << "p1";
  EXPECT_NEAR(camera->depth_lens.k[3], -0.000051, 1e-6) << "p2";
  EXPECT_NEAR(camera->distortion[4], 1.632723, 1e-6) << "k3";
  EXPECT_NEAR(camera->distortion[7], 1.565053, 1e-6) << "k6";
  EXPECT_EQ(camera->color_from_depth->translation, Eigen::Vector3d(-0.032, -0.002, 0.004));
  EXPECT_EQ(camera->depth_scale, 1000.0);
}

TEST(AzureKinect, ModesCutTheSensorDifferently) {
  const auto binned = azure_kinect_camera(calibration().dump(), "WFOV_2X2BINNED", 720);
  ASSERT_TRUE(binned);
  EXPECT_EQ(binned->depth->width, 512);
  EXPECT_NEAR(binned->depth->cx, 0.5122697949409485 * 512 - 0.5, 1e-9);
  EXPECT_NEAR(binned->color.cy, 0.5108628273010254 * 960 - 120 - 0.5, 1e-9);
  EXPECT_FALSE(azure_depth_size("PASSIVE_IR"));
}

TEST(AzureKinect, WhatIsNotKnownIsRefused) {
  const auto refusal = [](const nlohmann::json& json, const char* mode = "NFOV_UNBINNED", int height = 720) {
    const auto camera = azure_kinect_camera(json.dump(), mode, height);
    EXPECT_FALSE(camera);
    return camera ? "" : camera.error().message;
  };
  EXPECT_THAT(refusal(calibration(), "PASSIVE_IR"), HasSubstr("'PASSIVE_IR'"));
  EXPECT_THAT(refusal(calibration(), "NFOV_UNBINNED", 480), HasSubstr("480 pixels"));
  nlohmann::json other = calibration();
  other["CalibrationInformation"]["Cameras"][0]["Intrinsics"]["ModelType"] =
      "CALIBRATION_LensDistortionModelTheta";
  EXPECT_THAT(refusal(other), HasSubstr("ModelTheta"));
  other = calibration();
  other["CalibrationInformation"]["Cameras"][1]["Intrinsics"]["ModelParameters"].erase(0);
  EXPECT_THAT(refusal(other), HasSubstr("damaged"));
  EXPECT_THAT(refusal(nlohmann::json::object()), HasSubstr("lens model ''"));
}

TEST(AzureKinect, AnotherMatroskaFileIsSaidToBeNone) {
  MemoryLog log;
  const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "plumbline_film.mkv";
  std::ofstream(file, std::ios::binary) << "\x1A\x45\xDF\xA3" << std::string(400, '\0');
  const auto source = open_recording(file, {}, log);
  ASSERT_FALSE(source);
  EXPECT_EQ(source.error().kind, core::ErrorKind::kInput);
  EXPECT_THAT(source.error().message, HasSubstr("plumbline_film.mkv"));
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace plumbline::dataset
