// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "app.hpp"
#include "plumbline/net/live_map.hpp"

namespace plumbline::cli {

/// Address at which a growing map can be watched in the browser.
struct PageAddress {
  std::string http;   ///< HOST:PORT; empty: nowhere
  std::string token;  ///< token that every browser must present; empty: none
};

/// --http and --http-token.
void add_live_options(CLI::App& command, PageAddress& page);

/// Serves the map that grows in `output`, and prints the address; null: no address was given. Errors as
/// LiveMap::start.
core::Result<std::unique_ptr<net::LiveMap>> live_map(const PageAddress& page,
                                                     const std::filesystem::path& output, Console& console);

}  // namespace plumbline::cli
