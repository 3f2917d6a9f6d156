// SPDX-License-Identifier: BSD-3-Clause
#include "live_page.hpp"

namespace plumbline::cli {

/// Address and token of the page.
void add_live_options(CLI::App& command, PageAddress& page) {
  command
      .add_option("--http", page.http,
                  "Show the map in the browser while it grows, at this address (127.0.0.1:8080)")
      ->type_name("HOST:PORT");
  command
      .add_option("--http-token", page.token,
                  "Token that every browser must present; it is part of the address that is printed")
      ->type_name("TEXT");
}

/// The page of the growing map; none without --http.
core::Result<std::unique_ptr<net::LiveMap>> live_map(const PageAddress& page,
                                                     const std::filesystem::path& output, Console& console) {
  if (page.http.empty()) return nullptr;
  const auto options = net::page_server_options(page.http, page.token);
  if (!options) return tl::unexpected(options.error());
  if (const std::string warning = net::open_to_others(*options); !warning.empty()) console.warning(warning);
  auto live = net::LiveMap::start(*options, output);
  if (live) console.info("the map is shown at " + (*live)->address());
  return live;
}

}  // namespace plumbline::cli
