// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/net/page_server.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <utility>

#include "http/http_functions.hpp"

namespace plumbline::net {
namespace {

bool all_digits(const std::string& text) {
  return !text.empty() &&
         std::all_of(text.begin(), text.end(), [](unsigned char c) { return std::isdigit(c) != 0; });
}

}  // namespace

core::Result<PageServerOptions> page_server_options(const std::string& address, const std::string& token) {
  PageServerOptions options;
  options.token = token;
  const std::size_t bracket = address.rfind(']');
  const std::size_t colon = address.find(':', bracket == std::string::npos ? 0 : bracket);
  std::string host = address.substr(0, colon);
  std::string port = colon == std::string::npos ? std::string() : address.substr(colon + 1);
  if (colon == std::string::npos && all_digits(address)) std::swap(host, port);
  if (bracket != std::string::npos && host.size() > 2) host = host.substr(1, host.size() - 2);

  const bool right = port.empty() || (all_digits(port) && port.size() <= 5 && std::stoi(port) <= 65535);
  if (address.empty() || address == ":" || !right)
    return core::usage_error(fmt::format("--http {}: takes HOST:PORT, such as 127.0.0.1:8080", address));
  if (!host.empty()) options.host = host;
  if (!port.empty()) options.port = std::stoi(port);
  return options;
}

core::Result<PageServer> PageServer::start(const PageServerOptions& options, std::string page) {
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
                     options_.token.empty() ? "" : "?token=", options_.token);
}

void PageServer::send(const std::string& json, const std::string& topic) {
  (*core::part<HttpFunctions>())->send(server_, json, topic);
}

}  // namespace plumbline::net
