// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// One page over HTTP, and what is new as a stream of server-sent events; by default for browsers on this
// machine only.
#include <cstddef>
#include <memory>
#include <string>

#include "plumbline/core/error.hpp"

namespace plumbline::net {

struct PageServerOptions {
  std::string host = "127.0.0.1";  ///< address to listen at
  int port = 8080;                 ///< 0: any that is free
  std::string token;  ///< empty: none. Else asked for as ?token=..., or as "Authorization: Bearer ..."
};

/// "HOST:PORT", "HOST" or "PORT"; [::1] in brackets. Errors (kUsage).
core::Result<PageServerOptions> page_server_options(const std::string& address, const std::string& token);

/// Checks that a server could listen there, before a page is made for it. Errors (kUsage): what is wrong with
/// host or port.
core::Result<void> check_listening(const PageServerOptions& options);

/// A warning if other machines than this one reach the address and no token is asked for; else "".
std::string open_to_others(const PageServerOptions& options);

/// Limits of a server: connections at once (the rest are closed unread); event streams;
/// threads for pages besides them; events that wait for a slow stream, which loses the oldest beyond.
struct PageServerLimits {
  static constexpr std::size_t kSockets = 32;
  static constexpr std::size_t kStreams = 8;
  static constexpr std::size_t kPageThreads = 4;
  static constexpr std::size_t kWaitingEvents = 256;
};

/// Serves GET / (the page) and GET /events. Refused are other paths and methods (404), a Host or an Origin
/// that is not the server's own (403), more than one Host (400), a wrong token (401), and excess streams
/// (503). A request must be complete within a second. Thread-safe; send() never waits for a client.
class PageServer {
 public:
  /// Errors (kUsage): the server cannot listen at the address; (kInternal): the part is missing.
  static core::Result<PageServer> start(const PageServerOptions& options, std::string page);
  PageServer(PageServer&& other) noexcept;
  PageServer& operator=(PageServer&&) = delete;
  ~PageServer();  ///< ends all connections

  [[nodiscard]] int port() const;
  /// "http://127.0.0.1:8080/", with the token, percent-encoded.
  [[nodiscard]] std::string address() const;
  /// An event for each stream that is open: one line of JSON. With a `topic` it is kept, in the place of the
  /// last one of the same, for streams that open later.
  void send(const std::string& json, const std::string& topic = {});

 private:
  PageServer() = default;
  PageServerOptions options_;
  void* server_ = nullptr;  ///< of the part
};

}  // namespace plumbline::net
