// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// How robots and hub find each other (docs/guide/network.md).
#include <filesystem>
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"

namespace plumbline::net {

enum class Transport { kUdp, kTcp };

struct NetworkOptions {
  int domain = 0;         ///< 0 to 230: who has another one is not seen
  std::string interface;  ///< name; empty: the one of the default route, or lo
  std::vector<std::string>
      peers;  ///< HOST or HOST:PORT to look for others at, instead of asking all by multicast
  Transport transport = Transport::kUdp;
  int port = 0;                    ///< TCP: the hub's (0: 7500); UDP: where ports are counted from (0: 7400)
  std::filesystem::path security;  ///< folder with keys of this robot or hub; empty: none
};

/// Interface and peers as they will be used. Errors (kUsage): no such interface, a name or number that cannot
/// be, a TCP robot without peer.
core::Result<NetworkOptions> checked(NetworkOptions options, bool hub);

/// Names become folders, lines of logs and text on terminals: [A-Za-z0-9][A-Za-z0-9._-]{0,63}.
bool is_robot_name(const std::string& name);

}  // namespace plumbline::net
