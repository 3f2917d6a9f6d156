// SPDX-License-Identifier: BSD-3-Clause
// Inertial sensor, wheels, and films with both as MCAP files.
#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <opencv2/core.hpp>

#include "bags/bag_parts.hpp"
#include "plumbline/synth/recording.hpp"
#include "recording/body_sensors.hpp"

namespace plumbline::synth {
namespace {

namespace fs = std::filesystem;
const std::string kBodyScenes = std::string(PLUMBLINE_SOURCE_DIR) + "/pipelines/scenes";

/// Ten seconds and a little of a hand-held walk through the room.
const SynthSource& walk() {
  static const std::unique_ptr<SynthSource> kWalk = [] {
    SynthOptions options;
    options.frames = 310;
    options.width = 64;
    options.height = 48;
    options.sensor = Sensor::kIdeal;
    const core::Executor executor(1);
    return std::move(
        *SynthSource::create(*build_world(*load_scene("room", kBodyScenes), options, executor), 0));
  }();
  return *kWalk;
}

TEST(SynthBody, IdealGyroscopeAndAccelerometerIntegrateToTheTruth) {
  const auto readings = imu_readings(walk(), *imu_model("ideal"), 1);
  ASSERT_GT(readings.size(), 2000U);
  const geometry::Rigid3 camera_from_body = walk().body_from_camera().inverse();
  const auto body = [&](double stamp) { return walk().motion(stamp, camera_from_body).world_from_frame; };
  Eigen::Matrix3d r = body(readings[0].stamp).rotation;
  Eigen::Vector3d v = walk().motion(readings[0].stamp).velocity;
  double turned = 0.0;
  for (std::size_t i = 0; i < 2000; ++i) {  // 10 s
    const double dt = readings[i + 1].stamp - readings[i].stamp;
    const Eigen::Vector3d rate = 0.5 * (readings[i].turn_rate + readings[i + 1].turn_rate);
    const Eigen::Matrix3d half = r * geometry::exp_so3(0.5 * dt * rate);
    v += dt * (half * (0.5 * (readings[i].acceleration + readings[i + 1].acceleration)) -
               Eigen::Vector3d(0, 0, 9.81));
    r = r * geometry::exp_so3(dt * rate);
    turned += dt * rate.norm();
  }
  const double end = readings[2000].stamp;
  EXPECT_GT(turned, 1.0);
  EXPECT_LT(geometry::rotation_angle(r.transpose() * body(end).rotation) * 180.0 / M_PI, 0.1);
  EXPECT_LT((v - walk().motion(end).velocity).norm(), 0.02);
}

TEST(SynthBody, ErrorsAreAsLargeAsTheyAreSaidToBe) {
  const auto truth = imu_readings(walk(), *imu_model("ideal"), 1);
  const auto noisy = imu_readings(walk(), *imu_model("ideal,gyro_noise=0.002,accel_noise=0.03,delay=5ms"), 1);
  ASSERT_EQ(truth.size(), noisy.size());
  double gyro = 0.0, accel = 0.0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    EXPECT_NEAR(noisy[i].stamp - truth[i].stamp, 0.005, 1e-9);
    gyro += (noisy[i].turn_rate - truth[i].turn_rate).squaredNorm() / 3.0;
    accel += (noisy[i].acceleration - truth[i].acceleration).squaredNorm() / 3.0;
  }
  const double count = static_cast<double>(truth.size());
  EXPECT_NEAR(std::sqrt(gyro / count) / (0.002 * std::sqrt(200.0)), 1.0, 0.05);
  EXPECT_NEAR(std::sqrt(accel / count) / (0.03 * std::sqrt(200.0)), 1.0, 0.05);

  // Readings are missing 50 ms at a time.
  const auto gappy = imu_readings(walk(), *imu_model("ideal,gaps=60"), 1);
  EXPECT_NEAR(static_cast<double>(truth.size() - gappy.size()), 100.0, 70.0);
  const auto wrong = imu_model("usual,gyro_bais=1");
  ASSERT_FALSE(wrong);
  EXPECT_NE(wrong.error().message.find("gyro_bias"), std::string::npos);
}

TEST(SynthBody, WheelsMeasureThePathInThePlane) {
  const auto readings = odometry_readings(walk(), *odometry_model("ideal"), 1);
  const geometry::Rigid3 first = walk().motion(readings.front().stamp).world_from_frame,
                         last = walk().motion(readings.back().stamp).world_from_frame;
  const auto yaw = [](const geometry::Rigid3& pose) {
    const Eigen::Vector3d ahead = pose.rotation * Eigen::Vector3d::UnitZ();
    return std::atan2(ahead.y(), ahead.x());
  };
  const Eigen::Vector2d moved =
      Eigen::Rotation2Dd(-yaw(first)) * (last.translation - first.translation).head<2>();
  const geometry::Rigid3& end = readings.back().odom_from_body;
  EXPECT_GT(moved.norm(), 0.5);
  EXPECT_LT((end.translation.head<2>() - moved).norm(), 0.01);
  EXPECT_EQ(end.translation.z(), 0.0);
  EXPECT_NEAR(
      std::remainder(2.0 * std::atan2(end.quaternion().z(), end.quaternion().w()) - yaw(last) + yaw(first),
                     2 * M_PI),
      0.0, 1e-3);

  const auto usual = odometry_readings(walk(), *odometry_model("usual"), 1);
  const double off = (usual.back().odom_from_body.translation - end.translation).norm();
  EXPECT_GT(off, 0.003);
  EXPECT_LT(off, 0.3);
}

TEST(SynthBody, McapHasThePicturesAndWhatTheBodyMeasured) {
  const fs::path folder = fs::path(::testing::TempDir()) / ("plumbline_mcap_" + std::to_string(::getpid()));
  fs::remove_all(folder);
  SynthOptions options;
  options.frames = 12;
  options.width = 160;
  options.height = 120;
  options.reference_spacing = 0.05;
  options.mcap = true;
  options.imu = "usual";
  options.odometry = "usual";
  const auto scene = load_scene("structure", kBodyScenes);
  const core::Executor executor(2);
  const auto log = core::null_log();
  const auto written = write_recordings({*scene, options, folder}, executor, {}, *log, {});
  ASSERT_TRUE(written) << written.error().message;
  EXPECT_EQ(written->frames, 12U);

  const fs::path file = folder / "robot0" / "recording.mcap";
  const auto read = dataset::open_recording(file, {}, *log);
  ASSERT_TRUE(read) << read.error().message;
  const auto rendered =
      open_synth("synth:structure?frames=12&width=160&height=120", kBodyScenes, executor, *log);
  ASSERT_EQ((*read)->size(), 12U);
  for (const std::size_t i : {0U, 7U}) {
    const auto a = (*read)->read(i), b = (*rendered)->read(i);
    EXPECT_EQ(cv::norm(a->color, b->color, cv::NORM_INF), 0.0);
    EXPECT_LT(cv::norm(a->depth, b->depth, cv::NORM_INF), 1e-5);
    EXPECT_NEAR(a->stamp, b->stamp, 1e-6);
  }
  for (const char* name : {"groundtruth.txt", "truth.csv", "imu.csv", "odometry.csv", "camera.yaml"})
    EXPECT_TRUE(fs::exists(folder / "robot0" / name)) << name;
  EXPECT_FALSE(fs::exists(folder / "robot0" / "rgb"));

  // Messages are those of the tables.
  const auto bag = (*core::part<dataset::BagReaders>())->open(file);
  ASSERT_TRUE(bag) << bag.error().message;
  std::map<std::string, std::vector<dataset::MessagePlace>> places;
  std::vector<std::pair<std::size_t, dataset::MessagePlace>> found;
  ASSERT_TRUE(
      (*bag)->scan([&](const dataset::BagEntry& entry) { found.emplace_back(entry.topic, entry.place); }));
  for (const auto& [topic, place] : found) {
    const dataset::BagTopic& t = (*bag)->topics()[topic];
    places[t.name + " " + t.type].push_back(place);
  }
  EXPECT_EQ(places["/tf_static tf2_msgs/TFMessage"].size(), 1U);
  std::ifstream table(folder / "robot0" / "imu.csv");
  std::string line;
  std::size_t rows = 0;
  std::string first_row;
  std::getline(table, line);
  for (; std::getline(table, line); ++rows) {
    if (rows == 0) first_row = line;
  }
  ASSERT_EQ(places["/imu sensor_msgs/Imu"].size(), rows);
  EXPECT_GT(places["/odom nav_msgs/Odometry"].size(), 15U);
  const auto bytes = (*bag)->read(places["/imu sensor_msgs/Imu"][0]);
  ASSERT_TRUE(bytes);
  // encapsulation 4, stamp 8, "base_link" 4 + 10, padding to 24 + 4; orientation and its covariance 13
  // numbers
  ASSERT_EQ(bytes->size(), 4U + 24U + 8U * (13U + 12U + 12U));
  double rate[3];
  std::memcpy(rate, bytes->data() + 28 + 8 * 13, sizeof rate);
  double stamp = 0.0, wx = 0.0, wy = 0.0, wz = 0.0;
  ASSERT_EQ(std::sscanf(first_row.c_str(), "%lf,%lf,%lf,%lf", &stamp, &wx, &wy, &wz), 4);
  EXPECT_NEAR(rate[0], wx, 1e-6);
  EXPECT_NEAR(rate[2], wz, 1e-6);
  fs::remove_all(folder);
}

TEST(SynthBody, CamerasOfARigLookFromTheirPlacesOnOneBody) {
  const fs::path file =
      fs::path(::testing::TempDir()) / ("plumbline_rig_" + std::to_string(::getpid()) + ".yaml");
  std::ofstream(file)
      << "cameras:\n  - {at: [0.1, 0, 0]}\n  - {at: [-0.1, 0.05, 0.2], yaw: 180 deg, pitch: 10 deg}\n";
  const core::Executor executor(1);
  const auto log = core::null_log();
  const std::string address = "synth:room?frames=4&width=64&height=48&sensor=ideal&rig=" + file.string();
  const auto front = open_synth(address + "&robot=0", kBodyScenes, executor, *log);
  const auto back = open_synth(address + "&robot=1", kBodyScenes, executor, *log);
  ASSERT_TRUE(front && back) << (front ? back.error().message : front.error().message);
  const auto alone =
      open_synth("synth:room?frames=4&width=64&height=48&sensor=ideal", kBodyScenes, executor, *log);

  for (std::size_t i = 0; i < 4; ++i) {
    const geometry::Rigid3 a = (*(*front)->truth())[i].world_from_camera,
                           b = (*(*back)->truth())[i].world_from_camera,
                           path = (*(*alone)->truth())[i].world_from_camera;
    // In the frame of the front camera: x right, y down, z forward.
    const geometry::Rigid3 front_from_back = a.inverse() * b;
    EXPECT_LT((front_from_back.translation - Eigen::Vector3d(-0.05, -0.2, -0.2)).norm(), 1e-9);
    const Eigen::Vector3d ahead = front_from_back.rotation * Eigen::Vector3d::UnitZ();
    EXPECT_LT((ahead - Eigen::Vector3d(0.0, -std::sin(10 * M_PI / 180), -std::cos(10 * M_PI / 180))).norm(),
              1e-9);
    EXPECT_LT((path.inverse() * a.translation - Eigen::Vector3d(0, 0, 0.1)).norm(), 1e-9);
  }

  EXPECT_FALSE(open_synth(address + "&robot=2", kBodyScenes, executor, *log));
  std::ofstream(file) << "cameras:\n  - {at: [0.1, 0, 0], yaww: 3 deg}\n";
  const auto wrong = open_synth(address, kBodyScenes, executor, *log);
  ASSERT_FALSE(wrong);
  EXPECT_NE(wrong.error().message.find(":2:"), std::string::npos) << wrong.error().message;
  fs::remove(file);
}

}  // namespace
}  // namespace plumbline::synth
