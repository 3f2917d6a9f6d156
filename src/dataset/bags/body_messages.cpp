// SPDX-License-Identifier: BSD-3-Clause
#include "bags/body_messages.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "bags/bag_camera.hpp"
#include "layout.hpp"
#include "text_lines.hpp"

namespace plumbline::dataset {
namespace {

/// True for "odom" and names that end in it, "/robot1/odom".
bool is_odometry_frame(const std::string& frame) {
  constexpr std::string_view kOdom = "odom";
  return frame.size() >= kOdom.size() && frame.compare(frame.size() - kOdom.size(), kOdom.size(), kOdom) == 0;
}

/// Adds a reading that is later than the last one.
template <typename Reading>
void append(std::vector<Reading>& readings, const Reading& reading) {
  if (readings.empty() || reading.stamp > readings.back().stamp) readings.push_back(reading);
}

OdometryReading reading_of(std::int64_t stamp_ns, const geometry::Rigid3& odom_from_body) {
  OdometryReading reading;
  reading.stamp = seconds_of(stamp_ns);
  reading.odom_from_body = odom_from_body;
  reading.velocity.setZero();
  return reading;
}

}  // namespace

bool tells_of_body(const BagTopic& topic) {
  return topic.type == "sensor_msgs/Imu" || topic.type == "nav_msgs/Odometry" || topic.name == "/tf";
}

void BodyMessages::add_imu(const std::string& topic, const ImuMessage& message) {
  const ImuReading reading{seconds_of(message.header.stamp_ns), message.turn_rate, message.acceleration};

  // The first topic with turn rates is the IMU
  if (imu_topic_.empty() && !reading.turn_rate.isZero(0.0)) imu_topic_ = topic;
  if (topic == imu_topic_)
    append(imu_, reading);
  else if (reading.turn_rate.isZero(0.0) && !reading.acceleration.isZero(0.0))
    append(accelerations_, reading);

  // Accelerations may come from a second topic
  if (!imu_.empty() && !accelerations_.empty() && imu_.back().acceleration.isZero(0.0))
    imu_.back().acceleration = accelerations_.back().acceleration;
}

void BodyMessages::add(const BagTopic& topic, const MessageDecoder& decoder, const Bytes& bytes) {
  if (topic.type == "sensor_msgs/Imu") {
    const auto message = decoder.imu(bytes);
    if (message && message->header.stamp_ns != 0) add_imu(topic.name, *message);
    return;
  }

  // The first topic of odometry counts
  if (topic.type == "nav_msgs/Odometry") {
    const auto message = decoder.odometry(bytes);
    if (!message || message->stamp_ns == 0) return;
    if (odometry_topic_.empty()) odometry_topic_ = topic.name;
    if (topic.name != odometry_topic_) return;
    odometry_frame_ = message->child;
    append(odometry_, reading_of(message->stamp_ns, message->parent_from_child));
    return;
  }

  // Transforms from an odometry frame are odometry, too
  const auto message = decoder.transforms(bytes);
  if (!message) return;
  for (const TransformMessage& t : *message) {
    if (!is_odometry_frame(t.parent) || t.stamp_ns == 0) continue;
    if (moved_frame_.empty()) moved_frame_ = t.child;
    if (t.child == moved_frame_) append(transforms_, reading_of(t.stamp_ns, t.parent_from_child));
  }
}

void BodyMessages::join_accelerations() {
  for (ImuReading& reading : imu_) {
    if (accelerations_.empty() || !reading.acceleration.isZero(0.0)) continue;
    const auto next = std::upper_bound(accelerations_.begin(), accelerations_.end(), reading, kByStamp);
    reading.acceleration = (next == accelerations_.begin() ? next : next - 1)->acceleration;
  }
}

std::shared_ptr<const BodyReadings> read_bag_body(const BagSurvey& survey, const ChosenTopics& topics,
                                                  core::Log& log) {
  // The topic with the most messages comes first
  std::vector<const SurveyedTopic*> told;
  for (const SurveyedTopic& topic : survey.topics) {
    if (tells_of_body(topic.topic) && topic.decoder != nullptr) told.push_back(&topic);
  }
  std::stable_sort(told.begin(), told.end(),
                   [](const auto* a, const auto* b) { return a->count > b->count; });

  BodyMessages messages;
  for (const SurveyedTopic* topic : told) {
    for (const MessagePlace& place : topic->others) {
      if (const auto bytes = survey.files.at(place.file)->read(place))
        messages.add(topic->topic, *topic->decoder, *bytes);
    }
  }
  messages.join_accelerations();
  if (messages.imu().empty() && messages.odometry().empty()) return nullptr;

  auto body = std::make_shared<BodyReadings>();
  body->imu = messages.imu();
  body->odometry = messages.odometry();
  if (!body->odometry.empty())
    body->body_from_camera = body_from_camera(survey, topics, messages.body_frame());
  log.info(fmt::format("{}: {} readings of an inertial sensor, {} of odometry", survey.path, body->imu.size(),
                       body->odometry.size()));
  return body;
}

}  // namespace plumbline::dataset
