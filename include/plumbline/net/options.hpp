// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Options by which robots and hub find each other (docs/guide/network.md).
#include <filesystem>
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"

namespace plumbline::net {

enum class Transport { kUdp, kTcp };

struct NetworkOptions {
  int domain = 0;         ///< 0 to 230: only participants of one domain see each other
  std::string interface;  ///< name; empty: that of the default route, or lo
  /// HOST or HOST:PORT to look for others at, instead of multicast.
  std::vector<std::string> peers;
  Transport transport = Transport::kUdp;
  int port = 0;                    ///< TCP: the hub's port (0: 7500); UDP: the first port (0: 7400)
  std::filesystem::path security;  ///< folder with keys of this robot or hub; empty: none
};

/// Checks the options and fills in interface, port and peers. Errors (kUsage): no such interface, an invalid
/// name or number, a TCP robot without peer.
core::Result<NetworkOptions> checked(NetworkOptions options, bool hub);

/// True if a name matches [A-Za-z0-9][A-Za-z0-9._-]{0,63}: names become folders and text in logs.
bool is_robot_name(const std::string& name);

}  // namespace plumbline::net
