// SPDX-License-Identifier: BSD-3-Clause
#include "network_options.hpp"

#include <fmt/format.h>

#include <random>

namespace plumbline::cli {

void add_network_options(CLI::App& command, net::NetworkOptions& options) {
  // Domain and interface
  command
      .add_option("--domain", options.domain,
                  "DDS domain; only hub and robots of the same domain see each other (default: 0)")
      ->type_name("D")
      ->check(CLI::Range(0, 230));
  command
      .add_option("--interface", options.interface,
                  "Network interface (default: that of the default route; lo: this machine only)")
      ->type_name("IF");

  // Peers and transport
  command
      .add_option("--peers", options.peers,
                  "Addresses of the others, for networks without multicast (default: find them by multicast)")
      ->type_name("HOST[:PORT],...")
      ->delimiter(',')
      ->allow_extra_args(false);

  // Multicast and TCP exclude each other
  command
      .add_option_function<std::string>(
          "--transport",
          [&options](const std::string& name) {
            options.transport = name == "tcp" ? net::Transport::kTcp : net::Transport::kUdp;
          },
          "udp or tcp (default: udp)")
      ->check(CLI::IsMember({"udp", "tcp"}));

  // Port and keys
  command
      .add_option("--port", options.port,
                  "TCP: port of the hub (default: 7500); UDP: first port (default: 7400)")
      ->type_name("P")
      ->check(CLI::Range(1, 60000));
  command
      .add_option("--security", options.security,
                  "Folder with the keys of this robot or hub, made by plumbline keys create (default: none)")
      ->type_name("DIR");
}

/// The same options as text, for the command to repeat.
std::string network_arguments(const net::NetworkOptions& options) {
  std::string text;
  if (options.domain != 0) text += fmt::format(" --domain {}", options.domain);
  if (!options.interface.empty()) text += fmt::format(" --interface {}", options.interface);
  for (const std::string& peer : options.peers) text += fmt::format(" --peers {}", peer);
  if (options.transport == net::Transport::kTcp) text += " --transport tcp";
  if (options.port != 0) text += fmt::format(" --port {}", options.port);
  if (!options.security.empty()) text += fmt::format(" --security '{}'", options.security.string());
  return text;
}

std::string fresh_id() {
  std::random_device random;
  return fmt::format("{:08x}{:08x}", static_cast<std::uint32_t>(random()),
                     static_cast<std::uint32_t>(random()));
}

}  // namespace plumbline::cli
