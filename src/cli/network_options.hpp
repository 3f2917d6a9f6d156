// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What `hub` and `robot` have in common on the command line.
#include <CLI/CLI.hpp>
#include <string>

#include "plumbline/net/options.hpp"

namespace plumbline::cli {

/// --domain, --interface, --peers, --transport, --port, --security.
void add_network_options(CLI::App& command, net::NetworkOptions& options);
/// The same options again, for a command that is shown to the user; without those that were not given.
std::string network_arguments(const net::NetworkOptions& options);
/// 16 letters and digits that nobody else has.
std::string fresh_id();

}  // namespace plumbline::cli
