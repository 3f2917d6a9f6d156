// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Messages of wheels and inertial sensors, collected into readings.
#include <memory>
#include <string>
#include <vector>

#include "bags/topics.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/dataset/body_readings.hpp"

namespace plumbline::dataset {

/// True for sensor_msgs/Imu, nav_msgs/Odometry, and /tf, in which a robot may publish odom -> base.
bool tells_of_body(const BagTopic& topic);

/// Takes messages topic by topic (a bag) or as they come (live). The first topic of each
/// kind that measures something is used; nav_msgs/Odometry before /tf.
class BodyMessages {
 public:
  /// Messages that cannot be decoded, have no stamp or go back are left out.
  void add(const BagTopic& topic, const MessageDecoder& decoder, const Bytes& bytes);
  /// Gives turn rates the accelerations of a topic that has nothing else, as RealSense's recorder writes
  /// them.
  void join_accelerations();
  [[nodiscard]] const std::vector<ImuReading>& imu() const { return imu_; }
  [[nodiscard]] const std::vector<OdometryReading>& odometry() const {
    return odometry_.empty() ? transforms_ : odometry_;
  }
  /// The frame that odometry is about; "": not known.
  [[nodiscard]] const std::string& body_frame() const {
    return odometry_.empty() ? moved_frame_ : odometry_frame_;
  }

 private:
  void add_imu(const std::string& topic, const ImuMessage& message);

  std::string imu_topic_, odometry_topic_;
  std::string odometry_frame_, moved_frame_;
  std::vector<ImuReading> imu_;
  std::vector<ImuReading> accelerations_;  ///< of topics without turn rates
  std::vector<OdometryReading> odometry_;
  std::vector<OdometryReading> transforms_;  ///< of /tf
};

/// All readings of a bag; null: it has none.
std::shared_ptr<const BodyReadings> read_bag_body(const BagSurvey& survey, const ChosenTopics& topics,
                                                  core::Log& log);

}  // namespace plumbline::dataset
