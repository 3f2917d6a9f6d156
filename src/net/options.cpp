// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/net/options.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <sstream>

namespace plumbline::net {
namespace {

constexpr int kTcpPort = 7500;
constexpr int kMostPort = 60000;  // further ports follow it
constexpr int kMostDomain = 230;  // 250 ports each from 7400 on

bool made_of(const std::string& text, const char* others) {
  return std::all_of(text.begin(), text.end(), [&](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 ||
           std::string(others).find(c) != std::string::npos;
  });
}

/// Names of the interfaces that are up and have an IPv4 address.
std::vector<std::string> interfaces() {
  std::vector<std::string> names;
  ifaddrs* list = nullptr;
  if (getifaddrs(&list) != 0) return names;
  for (const ifaddrs* entry = list; entry != nullptr; entry = entry->ifa_next) {
    if (entry->ifa_addr == nullptr || entry->ifa_addr->sa_family != AF_INET) continue;
    if ((entry->ifa_flags & IFF_UP) != 0U) names.emplace_back(entry->ifa_name);
  }
  freeifaddrs(list);
  return names;
}

/// The interface of the default route; empty: there is none.
std::string default_route() {
  std::ifstream routes("/proc/net/route");
  std::string line;
  while (std::getline(routes, line)) {
    std::istringstream words(line);
    std::string name, destination;
    if (words >> name >> destination && destination == "00000000") return name;
  }
  return {};
}

/// The interface of the default route, else the first that is not loopback.
std::string choose_interface() {
  const std::vector<std::string> there = interfaces();
  const auto has = [&](const std::string& name) {
    return std::find(there.begin(), there.end(), name) != there.end();
  };
  if (const std::string name = default_route(); has(name)) return name;
  const auto other = std::find_if(there.begin(), there.end(), [](const std::string& n) { return n != "lo"; });
  return other == there.end() ? "lo" : *other;
}

}  // namespace

bool is_robot_name(const std::string& name) {
  constexpr std::size_t kMostLength = 64;
  return !name.empty() && name.size() <= kMostLength &&
         std::isalnum(static_cast<unsigned char>(name.front())) != 0 && made_of(name, "._-");
}

core::Result<NetworkOptions> checked(NetworkOptions options, bool hub) {
  // Numbers within DDS's and IP's ranges
  if (options.domain < 0 || options.domain > kMostDomain) {
    return core::usage_error(
        fmt::format("--domain: {} is not between 0 and {}", options.domain, kMostDomain));
  }
  if (options.port < 0 || options.port > kMostPort) {
    return core::usage_error(fmt::format("--port: {} is not between 1 and {}", options.port, kMostPort));
  }

  // The interface must be up
  const std::vector<std::string> there = interfaces();
  if (options.interface.empty()) {
    options.interface = choose_interface();
  } else if (std::find(there.begin(), there.end(), options.interface) == there.end()) {
    return core::usage_error(fmt::format("--interface: no interface '{}' is up; up are: {}",
                                         options.interface,
                                         there.empty() ? "none" : fmt::format("{}", fmt::join(there, ", "))));
  }

  // Names go into Cyclone's XML
  if (!made_of(options.interface, "._-@")) {
    return core::usage_error(fmt::format("--interface: '{}' cannot be used", options.interface));
  }

  // TCP has no multicast: peers must be named
  const bool tcp = options.transport == Transport::kTcp;
  if (tcp && options.port == 0) options.port = kTcpPort;
  for (std::string& peer : options.peers) {
    if (peer.empty() || !made_of(peer, "._-:[]")) {
      return core::usage_error(fmt::format("--peers: '{}' is not HOST or HOST:PORT", peer));
    }
    if (tcp && peer.find(':') == std::string::npos) peer += fmt::format(":{}", options.port);
  }

  // A robot cannot find a hub by TCP
  if (tcp && !hub && options.peers.empty()) {
    return core::usage_error("--transport tcp: name the hub with --peers HOST[:PORT]");
  }
  return options;
}

}  // namespace plumbline::net
