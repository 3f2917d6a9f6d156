// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Command line options common to `hub` and `robot`.
#include <CLI/CLI.hpp>
#include <string>

#include "plumbline/net/options.hpp"

namespace plumbline::cli {

/// --domain, --interface, --peers, --transport, --port, --security.
void add_network_options(CLI::App& command, net::NetworkOptions& options);
/// The options that were given, for a command that is shown to the user.
std::string network_arguments(const net::NetworkOptions& options);
/// A random id of 16 letters and digits.
std::string fresh_id();

}  // namespace plumbline::cli
