// SPDX-License-Identifier: BSD-3-Clause
#include "participant.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "ros.h"

namespace plumbline::net {
namespace {

const std::array<KnownType, 11> kTypes = {{
    {"sensor_msgs/Image", &sensor_msgs_msg_dds__Image__desc,
     "d31d41a9a4c4bc8eae9be757b0beed306564f7526c88ea6a4588fb9582527d47"},
    {"sensor_msgs/CompressedImage", &sensor_msgs_msg_dds__CompressedImage__desc, ""},
    {"sensor_msgs/CameraInfo", &sensor_msgs_msg_dds__CameraInfo__desc, ""},
    {"sensor_msgs/PointCloud2", &sensor_msgs_msg_dds__PointCloud2__desc,
     "9198cabf7da3796ae6fe19c4cb3bdd3525492988c70522628af5daa124bae2b5"},
    {"tf2_msgs/TFMessage", &tf2_msgs_msg_dds__TFMessage__desc, ""},
    {"sensor_msgs/Imu", &sensor_msgs_msg_dds__Imu__desc, ""},
    {"nav_msgs/Odometry", &nav_msgs_msg_dds__Odometry__desc, ""},
    {"nav_msgs/Path", &nav_msgs_msg_dds__Path__desc, ""},
    {"nav_msgs/OccupancyGrid", &nav_msgs_msg_dds__OccupancyGrid__desc, ""},
    {"map_msgs/OccupancyGridUpdate", &map_msgs_msg_dds__OccupancyGridUpdate__desc, ""},
    {"geometry_msgs/PoseWithCovarianceStamped", &geometry_msgs_msg_dds__PoseWithCovarianceStamped__desc, ""},
}};

/// Configuration of the domain as XML. The environment is not read.
std::string configuration(const NetworkOptions& options) {
  // lo may lack multicast: every possible port of this machine is tried there.
  std::vector<std::string> peers = options.peers;
  if (options.interface == "lo" && peers.empty()) peers.emplace_back("127.0.0.1");

  std::string xml = "<CycloneDDS><Domain Id=\"any\"><General>";
  xml += fmt::format("<Interfaces><NetworkInterface name=\"{}\"/></Interfaces>", options.interface);
  // Multicast of images floods a WiFi: it is used for discovery only.
  xml += fmt::format("<AllowMulticast>{}</AllowMulticast>", peers.empty() ? "spdp" : "false");

  // Large samples in few pieces: with the default ones, others' buffers lose most images.
  xml += "<MaxMessageSize>9000B</MaxMessageSize><FragmentSize>8000B</FragmentSize></General><Discovery>";

  if (!peers.empty()) {
    xml += "<ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>63</MaxAutoParticipantIndex>";
    xml += "<Peers>";
    for (const std::string& peer : peers) xml += fmt::format("<Peer Address=\"{}\"/>", peer);
    xml += "</Peers>";
  }
  xml += fmt::format("<ExternalDomainId>{}</ExternalDomainId>", options.domain);

  // Participants that start later are found at once.
  xml += "<SPDPInterval>1 s</SPDPInterval></Discovery>";

  // The largest receive buffer that the system gives; no memory for samples larger than any cloud.
  xml += "<Internal><SocketReceiveBufferSize max=\"8 MB\"/><MaxSampleSize>512 MB</MaxSampleSize></Internal>";
  return xml + "</Domain></CycloneDDS>";
}

/// Log lines of CycloneDDS are not shown to users: a call that fails returns an error.
void discard(void* /*unused*/, const dds_log_data_t* /*data*/) {}

}  // namespace

const KnownType* known_type(const std::string& name) {
  const auto found =
      std::find_if(kTypes.begin(), kTypes.end(), [&](const KnownType& type) { return name == type.name; });
  return found == kTypes.end() ? nullptr : &*found;
}

const KnownType* known_type_of_dds(const std::string& dds_name) { return known_type(ros_type(dds_name)); }

std::string ros_type(const std::string& dds_name) {
  constexpr const char* kMiddle = "::msg::dds_::";
  const std::size_t middle = dds_name.find(kMiddle);
  if (middle == std::string::npos || dds_name.back() != '_') return dds_name;
  const std::size_t begin = middle + std::string(kMiddle).size();
  return dds_name.substr(0, middle) + "/" + dds_name.substr(begin, dds_name.size() - begin - 1);
}

std::string ros_topic(const std::string& dds_name) {
  return dds_name.compare(0, 3, "rt/") == 0 ? dds_name.substr(2) : "";
}

std::string dds_topic(const std::string& ros_name) {
  return (!ros_name.empty() && ros_name.front() == '/' ? "rt" : "rt/") + ros_name;
}

Qos new_qos() { return {dds_create_qos(), &dds_delete_qos}; }

void pin_representation(Qos& qos) {
  // With XCDR2 others match and get nothing, without an error.
  const dds_data_representation_id_t only = DDS_DATA_REPRESENTATION_XCDR1;
  dds_qset_data_representation(qos.get(), 1, &only);
}

Ros2Participant::Ros2Participant() {
  dds_set_log_sink(&discard, nullptr);
  dds_set_trace_sink(&discard, nullptr);
}

Ros2Participant::~Ros2Participant() {
  if (participant_ > 0) dds_delete(participant_);
  if (domain_ > 0) dds_delete(domain_);
}

core::Result<void> Ros2Participant::open(const NetworkOptions& options, Ros2Role role) {
  // A process has one domain of each number, and one configuration of it: robots and hubs use the numbers
  // themselves. On the network they are the same.
  constexpr int kMostOfARole = 8, kApart = 10'000;
  const int base = role == Ros2Role::kListener ? 1000 : 2000;
  dds_domainid_t id = 0;
  domain_ = DDS_RETCODE_PRECONDITION_NOT_MET;
  for (int k = 0; k < kMostOfARole && domain_ == DDS_RETCODE_PRECONDITION_NOT_MET; ++k) {
    id = static_cast<dds_domainid_t>(base + kApart * k + options.domain);
    domain_ = dds_create_domain(id, configuration(options).c_str());
  }
  if (domain_ > 0) participant_ = dds_create_participant(id, nullptr, nullptr);
  if (participant_ > 0) return {};
  const dds_return_t code = domain_ <= 0 ? domain_ : participant_;
  return core::usage_error(
      fmt::format("ros2://{}: the network cannot be used on interface {} ({}); name another with ?interface=",
                  options.domain, options.interface, dds_strretcode(code)));
}

dds_entity_t Ros2Participant::topic(const std::string& ros_name, const KnownType& type) const {
  Qos qos = new_qos();
  pin_representation(qos);
  return dds_create_topic(participant_, type.descriptor, dds_topic(ros_name).c_str(), qos.get(), nullptr);
}

}  // namespace plumbline::net
