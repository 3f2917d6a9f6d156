// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// One participant as ROS 2's middleware would make it, and the types of messages that are known.
#include <dds/dds.h>

#include <cstdint>
#include <memory>
#include <string>

#include "plumbline/core/error.hpp"
#include "plumbline/net/options.hpp"

namespace plumbline::net {

// Samples that wait at either end, of a camera some seconds: a machine that is busy elsewhere loses none.
constexpr std::int32_t kSamplesKeptByReader = 200;
constexpr std::int32_t kSamplesKeptByWriter = 60;

struct KnownType {
  const char* name;  ///< "sensor_msgs/Image"
  const dds_topic_descriptor_t* descriptor;
  const char* hash;  ///< type hash that Iron and later look for; "": they print a harmless warning
};

/// Null: not known. `dds_name`: "sensor_msgs::msg::dds_::Image_".
const KnownType* known_type(const std::string& name);
const KnownType* known_type_of_dds(const std::string& dds_name);

/// "sensor_msgs::msg::dds_::Image_" as "sensor_msgs/Image"; other names as they are.
std::string ros_type(const std::string& dds_name);
/// "rt/camera/image" as "/camera/image"; "" if it is not a topic of ROS (services, parameters, others).
std::string ros_topic(const std::string& dds_name);
std::string dds_topic(const std::string& ros_name);

using Qos = std::unique_ptr<dds_qos_t, decltype(&dds_delete_qos)>;
Qos new_qos();
/// Settings of a topic: the data representation that every middleware of ROS 2 supports.
void pin_representation(Qos& qos);

enum class Ros2Role { kListener, kSpeaker };  ///< a process has one of each in a domain

/// Owns the domain and all entities in it.
class Ros2Participant {
 public:
  Ros2Participant();
  ~Ros2Participant();
  Ros2Participant(const Ros2Participant&) = delete;
  Ros2Participant& operator=(const Ros2Participant&) = delete;
  /// Error (kUsage): the network cannot be used.
  core::Result<void> open(const NetworkOptions& options, Ros2Role role);
  [[nodiscard]] dds_entity_t handle() const { return participant_; }
  /// Below zero: DDS refuses it.
  [[nodiscard]] dds_entity_t topic(const std::string& ros_name, const KnownType& type) const;

 private:
  dds_entity_t domain_ = 0;
  dds_entity_t participant_ = 0;
};

}  // namespace plumbline::net
