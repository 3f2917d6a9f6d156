// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "plumbline/core/part.hpp"
#include "plumbline/net/page_server.hpp"

namespace plumbline::net {

/// Functions of the part "http", which alone sees cpp-httplib.
struct HttpFunctions {
  static constexpr const char* kPart = "http";
  static constexpr std::uint64_t layout() { return core::layout_of<HttpFunctions, PageServerOptions>(); }

  /// Sets the port that was taken. Errors (kUsage).
  core::Result<void*> (*start)(PageServerOptions& options, std::string page);
  void (*send)(void* server, const std::string& json, const std::string& topic);
  void (*stop)(void* server);
};

}  // namespace plumbline::net
