// SPDX-License-Identifier: BSD-3-Clause
// Tables and messages of inertial sensors and wheels, as other programs write them.
#include <gmock/gmock.h>

#include <cstring>

#include "bags/bag_parts.hpp"
#include "bags/body_messages.hpp"
#include "test_dataset_world.hpp"

namespace plumbline::dataset {
namespace {

using testing::HasSubstr;

class BodyTables : public RecordingTest {
 protected:
  /// A recording of two frames, with a table.
  BodyReadings read_with(const std::string& name, const std::string& table, PoseUse poses = PoseUse::kPrior) {
    write_camera();
    for (const int i : {0, 1}) {
      write_image("rgb/" + std::to_string(i) + ".png", color_image(i));
      write_image("depth/" + std::to_string(i) + ".png", depth_image());
    }
    write_text("rgb.txt", "100.0 rgb/0.png\n100.1 rgb/1.png\n");
    write_text("depth.txt", "100.0 depth/0.png\n100.1 depth/1.png\n");
    write_text(name, table);
    OpenOptions options;
    options.poses = poses;
    log_.warnings.clear();
    const auto source = open_recording(folder_, options, log_);
    EXPECT_TRUE(source) << source.error().message;
    const auto* body = source ? dynamic_cast<const BodySource*>(source->get()) : nullptr;
    return body != nullptr ? body->body_readings(-1e300, -1e300, 1e300) : BodyReadings{};
  }
};

TEST_F(BodyTables, InertialSensorsOfSeveralPrograms) {
  const std::vector<std::pair<std::string, std::string>> tables = {
      {"imu.csv", "stamp,wx,wy,wz,ax,ay,az\n100.02,0.1,0.2,0.3,1,2,9\n100.01,0,0,0,0,0,9.81\n"},
      {"imu0/data.csv",
       "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],a_RS_S_x [m s^-2],"
       "a_RS_S_y [m s^-2],a_RS_S_z [m "
       "s^-2]\r\n100010000000,0,0,0,0,0,9.81\r\n100020000000,0.1,0.2,0.3,1,2,9\r\n"},
      {"imu.csv",
       "timestamp, a_x, a_y, a_z, alpha_x, alpha_y, alpha_z\n100.01, 0, 0, 9.81, 0, 0, 0\n"
       "100.02, 1, 2, 9, 0.1, 0.2, 0.3\n"},
  };
  for (const auto& [name, table] : tables) {
    SCOPED_TRACE(table);
    const BodyReadings read = read_with(name, table);
    std::filesystem::remove(folder_ / name);
    EXPECT_EQ(log_.warnings, "");
    ASSERT_EQ(read.imu.size(), 2U);
    EXPECT_NEAR(read.imu[1].stamp, 100.02, 1e-9);
    EXPECT_EQ(read.imu[1].turn_rate, Eigen::Vector3d(0.1, 0.2, 0.3));
    EXPECT_EQ(read.imu[1].acceleration, Eigen::Vector3d(1, 2, 9));
  }
}

TEST_F(BodyTables, WheelsInThePlaneOrInSpace) {
  const BodyReadings plane =
      read_with("odometry.csv", "stamp,x,y,yaw,vx,vy,wz\n100,0,0,0,0,0,0\n100.1,1,2,1.5707963,0,0,0\n");
  ASSERT_EQ(plane.odometry.size(), 2U);
  EXPECT_NEAR((plane.odometry[1].odom_from_body * Eigen::Vector3d(1, 0, 0) - Eigen::Vector3d(1, 3, 0)).norm(),
              0.0, 1e-6);
  const BodyReadings space =
      read_with("odometry.csv", "timestamp,x,y,z,qx,qy,qz,qw\n100,0,0,0,0,0,0,1\n100.1,1,2,0.5,0,0,1,0\n");
  ASSERT_EQ(space.odometry.size(), 2U);
  EXPECT_NEAR(
      (space.odometry[1].odom_from_body * Eigen::Vector3d(1, 0, 0) - Eigen::Vector3d(0, 2, 0.5)).norm(), 0.0,
      1e-6);
  EXPECT_TRUE(read_with("odometry.csv", "stamp,x,y,yaw\n100,0,0,0\n", PoseUse::kIgnore).odometry.empty());
}

TEST_F(BodyTables, WhatCannotBeUsedIsSaid) {
  EXPECT_TRUE(read_with("imu.csv", "stamp,wx,wy,wz\n100,0,0,0\n100.1,0,O,0\n").imu.empty());
  EXPECT_THAT(log_.warnings, HasSubstr("imu.csv:3: column 3 is not a number"));
  EXPECT_TRUE(read_with("imu.csv", "stamp,roll,pitch\n100,0,0\n").imu.empty());
  EXPECT_THAT(log_.warnings, HasSubstr("imu.csv:1: the header names no column 'wx'"));
}

/// A message of ROS 1 as rosbag has it, or of ROS 2.
class MessageBytes {
 public:
  explicit MessageBytes(bool ros1) : ros1_(ros1), bytes_(ros1 ? Bytes() : Bytes{0, 1, 0, 0}) {}
  template <typename T>
  void number(T value) {
    while (!ros1_ && (bytes_.size() - 4) % sizeof value != 0) bytes_.push_back(0);
    const auto* from = reinterpret_cast<const std::uint8_t*>(&value);
    bytes_.insert(bytes_.end(), from, from + sizeof value);
  }
  void text(const std::string& value) {
    const std::size_t end = ros1_ ? 0 : 1;
    number(static_cast<std::uint32_t>(value.size() + end));
    bytes_.insert(bytes_.end(), value.begin(), value.end());
    bytes_.resize(bytes_.size() + end);
  }
  void header(std::uint32_t seconds, const std::string& frame) {
    if (ros1_) number(std::uint32_t{0});
    number(seconds);
    number(std::uint32_t{500'000'000});
    text(frame);
  }
  void numbers(int count, double first) {
    for (int i = 0; i < count; ++i) number(first + i);
  }
  Bytes bytes_of() const { return bytes_; }

 private:
  bool ros1_;
  Bytes bytes_;
};

TEST(BodyMessagesTest, RosOneAndTwo) {
  const auto& readers = core::part<BagReaders>();
  ASSERT_TRUE(readers);
  for (const bool ros1 : {true, false}) {
    SCOPED_TRACE(ros1);
    const MessageDecoder& decoder = ros1 ? (*readers)->ros1() : (*readers)->cdr();
    BodyMessages collected;

    // As RealSense's recorder has them: turn rates and accelerations in topics of their own.
    MessageBytes accel(ros1), gyro(ros1);
    accel.header(10, "");
    accel.numbers(13, 0.0);
    accel.number(0.0), accel.number(0.0), accel.number(0.0);
    accel.numbers(9, 0.0);
    accel.number(0.1), accel.number(0.2), accel.number(9.8);
    accel.numbers(9, 0.0);
    gyro.header(11, "");
    gyro.numbers(13, 0.0);
    gyro.number(0.1), gyro.number(0.2), gyro.number(0.3);
    gyro.numbers(9, 0.0);
    for (int i = 0; i < 12; ++i) gyro.number(0.0);
    collected.add({"/device_0/sensor_2/Accel_0/imu/data", "sensor_msgs/Imu", ""}, decoder, accel.bytes_of());
    collected.add({"/device_0/sensor_2/Gyro_0/imu/data", "sensor_msgs/Imu", ""}, decoder, gyro.bytes_of());
    collected.join_accelerations();
    ASSERT_EQ(collected.imu().size(), 1U);
    EXPECT_EQ(collected.imu()[0].stamp, 11.5);
    EXPECT_EQ(collected.imu()[0].turn_rate, Eigen::Vector3d(0.1, 0.2, 0.3));
    EXPECT_EQ(collected.imu()[0].acceleration, Eigen::Vector3d(0.1, 0.2, 9.8));

    // /tf until there is a topic of its own.
    MessageBytes transform(ros1), odometry(ros1);
    transform.number(std::uint32_t{1});
    transform.header(12, "odom");
    transform.text("base_link");
    transform.numbers(3, 1.0);
    transform.number(0.0), transform.number(0.0), transform.number(0.0), transform.number(1.0);
    collected.add({"/tf", "tf2_msgs/TFMessage", ""}, decoder, transform.bytes_of());
    ASSERT_EQ(collected.odometry().size(), 1U);
    EXPECT_EQ(collected.body_frame(), "base_link");
    EXPECT_EQ(collected.odometry()[0].stamp, 12.5);

    odometry.header(13, "odom");
    odometry.text("base_footprint");
    odometry.numbers(3, 4.0);
    odometry.number(0.0), odometry.number(0.0), odometry.number(0.0), odometry.number(1.0);
    odometry.numbers(36 + 6 + 36, 0.0);
    collected.add({"/odom", "nav_msgs/Odometry", ""}, decoder, odometry.bytes_of());
    ASSERT_EQ(collected.odometry().size(), 1U);
    EXPECT_EQ(collected.body_frame(), "base_footprint");
    EXPECT_EQ(collected.odometry()[0].odom_from_body.translation, Eigen::Vector3d(4, 5, 6));

    // A message that is cut is left out.
    Bytes cut = odometry.bytes_of();
    cut.resize(cut.size() / 2);
    collected.add({"/odom", "nav_msgs/Odometry", ""}, decoder, cut);
    EXPECT_EQ(collected.odometry().size(), 1U);
  }
}

}  // namespace
}  // namespace plumbline::dataset
