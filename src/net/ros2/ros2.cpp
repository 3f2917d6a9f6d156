// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/net/ros2.hpp"

#include <fmt/format.h>

#include <charconv>
#include <sstream>

#include "ros2/ros2_part.hpp"

namespace plumbline::net {
namespace {

constexpr const char* kScheme = "ros2://";
constexpr const char* kAllowed = "interface, peers, color, depth, info, depth_info";

core::Error wrong(const std::string& address, const std::string& what) {
  return {core::ErrorKind::kUsage,
          fmt::format("{}: {}; an address is ros2://DOMAIN or ros2://DOMAIN?NAME=VALUE&... (names: {})",
                      address, what, kAllowed)};
}

std::vector<std::string> split(const std::string& text, char at) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, at);) parts.push_back(part);
  return parts;
}

/// "" when the setting was taken, else what is wrong.
std::string take(const std::string& setting, Ros2Address& into) {
  const std::size_t equals = setting.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == setting.size())
    return fmt::format("'{}' is not NAME=VALUE", setting);
  const std::string name = setting.substr(0, equals);
  const std::string value = setting.substr(equals + 1);

  // Settings of the network
  if (name == "interface") {
    into.network.interface = value;
    return "";
  }
  if (name == "peers") {
    into.network.peers = split(value, ',');
    return "";
  }

  // All other settings name a topic
  std::string* topic = name == "color"        ? &into.topics.color
                       : name == "depth"      ? &into.topics.depth
                       : name == "info"       ? &into.topics.info
                       : name == "depth_info" ? &into.topics.depth_info
                                              : nullptr;
  if (topic == nullptr) return fmt::format("'{}' is not a setting of an address", name);
  *topic = value.front() == '/' ? value : "/" + value;
  return "";
}

}  // namespace

core::Result<Ros2Address> parse_ros2_address(const std::string& address) {
  const std::string scheme = kScheme;
  if (address.compare(0, scheme.size(), scheme) != 0)
    return tl::unexpected(wrong(address, "is not an address of ROS 2"));

  // Settings follow a question mark
  const std::size_t question = address.find('?');
  const std::string domain = address.substr(
      scheme.size(), question == std::string::npos ? std::string::npos : question - scheme.size());

  // Only a whole number is a domain
  Ros2Address parsed;
  const char* end = domain.data() + domain.size();
  const auto [stop, error] = std::from_chars(domain.data(), end, parsed.network.domain);
  if (domain.empty() || error != std::errc() || stop != end) {
    return tl::unexpected(wrong(
        address,
        fmt::format("'{}' is not a domain (a number, ROS_DOMAIN_ID of the camera; 0 by default)", domain)));
  }

  if (question != std::string::npos) {
    for (const std::string& setting : split(address.substr(question + 1), '&')) {
      if (const std::string problem = take(setting, parsed); !problem.empty())
        return tl::unexpected(wrong(address, problem));
    }
  }

  auto network = checked(parsed.network, false);
  if (!network) return tl::unexpected(network.error());
  parsed.network = std::move(*network);
  return parsed;
}

core::Result<std::unique_ptr<dataset::MessageStream>> open_ros2_stream(const Ros2Address& address) {
  return core::part<Ros2Part>().and_then(
      [&](const Ros2Part* part) { return part->open_stream(address.network); });
}

core::Result<std::unique_ptr<dataset::MessageSink>> open_ros2_sink(const Ros2Address& address) {
  return core::part<Ros2Part>().and_then(
      [&](const Ros2Part* part) { return part->open_sink(address.network); });
}

core::Result<std::unique_ptr<dataset::MessageStream>> open_live_stream(const std::string& address,
                                                                       dataset::TopicNames& topics) {
  const auto parsed = parse_ros2_address(address);
  if (!parsed) return tl::unexpected(parsed.error());

  // Topics of the address replace given ones
  const std::pair<const std::string&, std::string&> names[] = {
      {parsed->topics.color, topics.color},
      {parsed->topics.depth, topics.depth},
      {parsed->topics.info, topics.info},
      {parsed->topics.depth_info, topics.depth_info}};
  for (const auto& [named, topic] : names) {
    if (!named.empty()) topic = named;
  }
  return open_ros2_stream(*parsed);
}

}  // namespace plumbline::net
