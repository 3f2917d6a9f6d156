// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/net/page_server.hpp"

#include <fmt/format.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <memory>
#include <utility>

#include "http/http_functions.hpp"

namespace plumbline::net {
namespace {

bool all_digits(const std::string& text) {
  return !text.empty() &&
         std::all_of(text.begin(), text.end(), [](unsigned char c) { return std::isdigit(c) != 0; });
}

/// The error with which the system refuses the address to a server; 0: none.
int bind_problem(const addrinfo& address) {
  const int descriptor = ::socket(address.ai_family, address.ai_socktype | SOCK_CLOEXEC, address.ai_protocol);
  if (descriptor < 0) return errno;
  const int yes = 1;
  ::setsockopt(descriptor, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
  const int problem = ::bind(descriptor, address.ai_addr, address.ai_addrlen) == 0 ? 0 : errno;
  ::close(descriptor);
  return problem;
}

std::string problem_text(int problem, const PageServerOptions& options) {
  switch (problem) {
    case EADDRINUSE:
      return fmt::format("port {} is in use; choose another one", options.port);
    case EADDRNOTAVAIL:
      return fmt::format("{} is not an address of this machine; 0.0.0.0 stands for all it has", options.host);
    case EACCES:
      return fmt::format("port {} is kept for the system; choose one from 1024 on", options.port);
    default:
      return fmt::format("cannot listen there ({})", std::strerror(problem));
  }
}

/// The text as a value in an address, where "&" and "#" would end it (RFC 3986: all but the unreserved is
/// encoded).
std::string percent_encoded(const std::string& text) {
  std::string encoded;
  for (const char c : text) {
    const bool plain = std::isalnum(static_cast<unsigned char>(c)) != 0 || std::strchr("-._~", c) != nullptr;
    encoded += plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return encoded;
}

/// True if only this machine reaches the address.
bool is_loopback(const addrinfo& address) {
  if (address.ai_family == AF_INET) {
    const auto* four = reinterpret_cast<const sockaddr_in*>(address.ai_addr);
    return (ntohl(four->sin_addr.s_addr) >> 24) == IN_LOOPBACKNET;
  }
  return address.ai_family == AF_INET6 &&
         IN6_IS_ADDR_LOOPBACK(&reinterpret_cast<const sockaddr_in6*>(address.ai_addr)->sin6_addr) != 0;
}

using Addresses = std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)>;

/// The addresses at which a server of these options listens; null: there is no such host.
Addresses addresses_of(const PageServerOptions& options) {
  addrinfo wanted{};
  wanted.ai_family = AF_UNSPEC;
  wanted.ai_socktype = SOCK_STREAM;
  wanted.ai_flags = AI_PASSIVE;
  addrinfo* found = nullptr;
  const int problem =
      ::getaddrinfo(options.host.c_str(), std::to_string(options.port).c_str(), &wanted, &found);
  return Addresses(problem == 0 ? found : nullptr, &::freeaddrinfo);
}

}  // namespace

core::Result<PageServerOptions> page_server_options(const std::string& address, const std::string& token) {
  PageServerOptions options;
  options.token = token;

  // IPv6 addresses stand in brackets
  const std::size_t bracket = address.rfind(']');
  const std::size_t colon = address.find(':', bracket == std::string::npos ? 0 : bracket);
  std::string host = address.substr(0, colon);
  std::string port = colon == std::string::npos ? std::string() : address.substr(colon + 1);

  // Digits alone are a port
  if (colon == std::string::npos && all_digits(address)) std::swap(host, port);
  if (bracket != std::string::npos && host.size() > 2) host = host.substr(1, host.size() - 2);

  const bool right = port.empty() || (all_digits(port) && port.size() <= 5 && std::stoi(port) <= 65535);
  if (address.empty() || address == ":" || !right)
    return core::usage_error(fmt::format("--http {}: takes HOST:PORT, such as 127.0.0.1:8080", address));
  if (!host.empty()) options.host = host;
  if (!port.empty()) options.port = std::stoi(port);
  return options;
}

core::Result<void> check_listening(const PageServerOptions& options) {
  const Addresses found = addresses_of(options);
  if (!found) {
    return core::usage_error(
        fmt::format("--http {0}:{1}: there is no host {0}; write HOST:PORT, such as 127.0.0.1:8080",
                    options.host, options.port));
  }

  // One address that can be bound is enough
  int problem = 0;
  for (const addrinfo* address = found.get(); address != nullptr; address = address->ai_next) {
    problem = bind_problem(*address);
    if (problem == 0) break;
  }
  if (problem == 0) return {};
  return core::usage_error(
      fmt::format("--http {}:{}: {}", options.host, options.port, problem_text(problem, options)));
}

std::string open_to_others(const PageServerOptions& options) {
  if (!options.token.empty()) return {};
  const Addresses found = addresses_of(options);

  // Loopback addresses are reached only from this machine
  for (const addrinfo* address = found.get(); address != nullptr; address = address->ai_next) {
    if (is_loopback(*address)) continue;
    return fmt::format(
        "--http {}:{}: everybody who reaches this address sees the map; --http-token TEXT asks for a token",
        options.host, options.port);
  }
  return {};
}

core::Result<PageServer> PageServer::start(const PageServerOptions& options, std::string page) {
  // A checked port gives a clearer message
  if (auto free = check_listening(options); !free) return tl::unexpected(free.error());
  const auto& http = core::part<HttpFunctions>();
  if (!http) return tl::unexpected(http.error());
  PageServer server;
  server.options_ = options;
  auto started = (*http)->start(server.options_, std::move(page));
  if (!started) return tl::unexpected(started.error());
  server.server_ = *started;
  return server;
}

PageServer::PageServer(PageServer&& other) noexcept
    : options_(std::move(other.options_)), server_(std::exchange(other.server_, nullptr)) {}

PageServer::~PageServer() {
  if (server_ != nullptr) (*core::part<HttpFunctions>())->stop(server_);
}

int PageServer::port() const { return options_.port; }

std::string PageServer::address() const {
  const bool six = options_.host.find(':') != std::string::npos;
  return fmt::format("http://{}{}{}:{}/{}{}", six ? "[" : "", options_.host, six ? "]" : "", options_.port,
                     options_.token.empty() ? "" : "?token=", percent_encoded(options_.token));
}

void PageServer::send(const std::string& json, const std::string& topic) {
  (*core::part<HttpFunctions>())->send(server_, json, topic);
}

}  // namespace plumbline::net
