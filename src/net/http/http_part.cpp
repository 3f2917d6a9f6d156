// SPDX-License-Identifier: BSD-3-Clause
// The HTTP server, by cpp-httplib; its task queue and its sockets are ours, so that no client takes more than
// its share.
#include <arpa/inet.h>
#include <fmt/format.h>
#include <httplib.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <thread>
#include <utility>
#include <vector>

#include "http/http_functions.hpp"

namespace plumbline::net {
namespace {

using Clock = std::chrono::steady_clock;
using Limits = PageServerLimits;
constexpr auto kReadTime = std::chrono::seconds(1);    // limit for receiving a request
constexpr auto kWriteTime = std::chrono::seconds(10);  // limit for sending a part of an answer
constexpr auto kBeat = std::chrono::seconds(5);        // an empty event, to find out who has gone

/// Set while a socket is to be closed unread.
thread_local bool refusing = false;

/// A fixed number of threads; requests are refused at once while too many wait.
class Tasks : public httplib::TaskQueue {
 public:
  /// Throws if the system has no more threads.
  Tasks() {
    try {
      for (std::size_t i = 0; i < Limits::kStreams + Limits::kPageThreads; ++i)
        threads_.emplace_back([this] { work(); });
    } catch (...) {
      Tasks::shutdown();
      throw;
    }
  }

  void enqueue(std::function<void()> task) override {
    {
      const std::lock_guard lock(mutex_);
      if (!stopped_ && waiting_.size() + busy_ < Limits::kSockets) {
        waiting_.push_back(std::move(task));
        wake_.notify_one();
        return;
      }
    }

    // Requests beyond the limit are refused, not queued
    refusing = true;
    task();
    refusing = false;
  }

  void shutdown() override {
    {
      const std::lock_guard lock(mutex_);
      stopped_ = true;
    }

    // Waiting requests are still answered
    wake_.notify_all();
    for (std::thread& thread : threads_) thread.join();
  }

 private:
  void work() {
    std::unique_lock lock(mutex_);
    while (true) {
      wake_.wait(lock, [&] { return stopped_ || !waiting_.empty(); });
      if (waiting_.empty()) return;
      const std::function<void()> task = std::move(waiting_.front());
      waiting_.pop_front();
      ++busy_;

      // Others may enqueue during the task
      lock.unlock();
      task();
      lock.lock();
      --busy_;
    }
  }

  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<std::function<void()>> waiting_;
  std::size_t busy_ = 0;
  bool stopped_ = false;
  std::vector<std::thread> threads_;
};

/// A connection whose whole request must come within kReadTime, however it trickles.
class Connection : public httplib::Stream {
 public:
  explicit Connection(socket_t socket) : socket_(socket) {}

  using httplib::Stream::write;
  [[nodiscard]] bool is_readable() const override { return ready(POLLIN, until_ - Clock::now()); }
  [[nodiscard]] bool is_writable() const override { return ready(POLLOUT, kWriteTime); }
  ssize_t read(char* to, std::size_t size) override {
    return is_readable() ? ::recv(socket_, to, size, 0) : -1;
  }
  ssize_t write(const char* from, std::size_t size) override {
    return is_writable() ? ::send(socket_, from, size, MSG_NOSIGNAL) : -1;
  }
  void get_remote_ip_and_port(std::string& ip, int& port) const override { ip.clear(), port = 0; }
  void get_local_ip_and_port(std::string& ip, int& port) const override { ip.clear(), port = 0; }
  [[nodiscard]] socket_t socket() const override { return socket_; }

 private:
  [[nodiscard]] bool ready(short what, Clock::duration within) const {
    pollfd one{socket_, what, 0};
    const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(within).count();
    return ms > 0 && ::poll(&one, 1, static_cast<int>(ms)) > 0 && (one.revents & what) != 0;
  }

  socket_t socket_;
  Clock::time_point until_ = Clock::now() + kReadTime;
};

/// One answer for each connection.
class Server : public httplib::Server {
 private:
  bool process_and_close_socket(socket_t socket) override {
    bool answered = false;
    if (!refusing) {
      Connection connection(socket);
      bool closed = false;
      answered = process_request(connection, true, closed, nullptr);
    }
    ::shutdown(socket, SHUT_RDWR);
    ::close(socket);
    return answered;
  }
};

/// Events that wait for one client.
struct Listener {
  std::deque<std::string> events;
  std::size_t most = Limits::kWaitingEvents;  ///< more where it began with what was kept
};

struct Events {
  std::mutex mutex;
  std::condition_variable news;
  std::map<std::string, std::string> kept;  ///< the last event of each topic
  std::list<Listener> listeners;
  bool ended = false;
};

std::string as_event(const std::string& json) { return "data: " + json + "\n\n"; }

void put(Listener& listener, const std::string& event) {
  if (listener.events.size() >= listener.most) listener.events.pop_front();
  listener.events.push_back(event);
}

struct Running {
  Server server;
  Events events;
  std::string page;
  std::string token;
  std::set<std::string> hosts;  ///< names by which the server may be addressed
  int port = 0;
  bool everywhere = false;  ///< it listens at all addresses
  std::thread thread;
};

/// Compares in a time that does not depend on the number of equal characters.
bool same_secret(const std::string& given, const std::string& right) {
  unsigned char differs = given.size() == right.size() ? 0 : 1;
  for (std::size_t i = 0; i < right.size(); ++i)
    differs |= static_cast<unsigned char>(right[i] ^ (i < given.size() ? given[i] : '\0'));
  return differs == 0;
}

/// True if a host names this server: one of its names or, if it listens at all addresses, any numeric address
/// (a foreign page can make a name resolve to this server, but not a number).
bool own_name(const Running& running, const std::string& host) {
  if (running.hosts.count(host) > 0) return true;
  const std::string ending = fmt::format(":{}", running.port);
  if (!running.everywhere || host.size() <= ending.size() ||
      host.compare(host.size() - ending.size(), ending.size(), ending) != 0)
    return false;
  std::string address = host.substr(0, host.size() - ending.size());
  if (address.front() == '[' && address.back() == ']') address = address.substr(1, address.size() - 2);
  in6_addr number{};
  return ::inet_pton(AF_INET, address.c_str(), &number) == 1 ||
         ::inet_pton(AF_INET6, address.c_str(), &number) == 1;
}

/// Status of a request that is refused; 0 if it is allowed.
int refused(const Running& running, const httplib::Request& request) {
  const std::string scheme = "http://";
  if (request.get_header_value_count("Host") > 1) return 400;
  if (!own_name(running, request.get_header_value("Host"))) return 403;
  if (request.has_header("Origin")) {
    const std::string origin = request.get_header_value("Origin");
    if (origin.rfind(scheme, 0) != 0 || !own_name(running, origin.substr(scheme.size()))) return 403;
  }
  if (running.token.empty()) return 0;
  const std::string bearer = "Bearer " + running.token;
  const bool right = same_secret(request.get_param_value("token"), running.token) ||
                     same_secret(request.get_header_value("Authorization"), bearer);
  return right ? 0 : 401;
}

/// Sends a listener's next events; false if it has left or the server ends.
bool stream_events(Events& events, Listener& listener, httplib::DataSink& sink) {
  std::string next;
  {
    std::unique_lock lock(events.mutex);
    events.news.wait_for(lock, kBeat, [&] { return events.ended || !listener.events.empty(); });
    if (events.ended) return false;
    for (; !listener.events.empty() && next.size() < 65536; listener.events.pop_front())
      next += listener.events.front();
  }
  if (next.empty()) next = ": still here\n\n";
  return sink.write(next.data(), next.size());
}

void answer_events(Events& events, httplib::Response& response) {
  std::list<Listener>::iterator listener;
  {
    // Each stream occupies a thread
    const std::lock_guard lock(events.mutex);
    if (events.listeners.size() >= Limits::kStreams || events.ended) {
      response.status = 503;
      response.set_content("as many streams as are allowed are open\n", "text/plain");
      return;
    }

    // A new listener gets the latest events first
    listener = events.listeners.emplace(events.listeners.end());
    listener->most += events.kept.size();
    for (const auto& [topic, event] : events.kept) put(*listener, event);
  }

  // Events follow until the listener leaves
  response.set_header("Cache-Control", "no-store");
  response.set_chunked_content_provider(
      "text/event-stream",
      [&events, listener](std::size_t /*offset*/, httplib::DataSink& sink) {
        return stream_events(events, *listener, sink);
      },
      [&events, listener](bool /*success*/) {
        const std::lock_guard lock(events.mutex);
        events.listeners.erase(listener);
      });
}

void set_routes(Running& running) {
  // The page loads nothing from other hosts
  running.server.set_default_headers(
      {{"X-Content-Type-Options", "nosniff"},
       {"Referrer-Policy", "no-referrer"},
       {"Content-Security-Policy",
        "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:; "
        "connect-src 'self'; frame-ancestors 'none'"}});

  // Token and host are checked before any route
  running.server.set_pre_routing_handler(
      [&running](const httplib::Request& request, httplib::Response& response) {
        const int status = refused(running, request);
        if (status == 0) return httplib::Server::HandlerResponse::Unhandled;
        response.status = status;
        response.set_content(status == 401   ? "a token is asked for: ?token=...\n"
                             : status == 400 ? "one Host is enough\n"
                                             : "this name is not served here\n",
                             "text/plain");
        return httplib::Server::HandlerResponse::Handled;
      });

  // The page is streamed without a copy
  running.server.Get("/", [&running](const httplib::Request& /*request*/, httplib::Response& response) {
    response.set_content_provider(
        running.page.size(), "text/html; charset=utf-8",
        [&running](std::size_t offset, std::size_t length, httplib::DataSink& sink) {
          return sink.write(running.page.data() + offset, length);
        });
  });

  // Each listener's answer stays open
  running.server.Get("/events", [&running](const httplib::Request& /*request*/, httplib::Response& response) {
    answer_events(running.events, response);
  });
}

core::Result<void*> start(PageServerOptions& options, std::string page) {
  auto running = std::make_unique<Running>();
  running->page = std::move(page);
  running->token = options.token;
  running->server.set_payload_max_length(1024);
  set_routes(*running);

  const int port = options.port == 0 ? running->server.bind_to_any_port(options.host)
                   : running->server.bind_to_port(options.host, options.port) ? options.port
                                                                              : -1;
  if (port <= 0) {
    return core::usage_error(
        fmt::format("--http {}:{}: cannot listen there; choose another port", options.host, options.port));
  }

  options.port = running->port = port;
  running->everywhere = options.host == "0.0.0.0" || options.host == "::";

  for (const std::string& name : {options.host, "[" + options.host + "]", std::string("localhost")}) {
    running->hosts.insert(fmt::format("{}:{}", name, port));
    if (port == 80) running->hosts.insert(name);
  }

  // Threads are started here, where it is an error of this call if the system has no more. The server deletes
  // its queue.
  auto tasks = std::make_unique<Tasks>();
  running->server.new_task_queue = [queue = tasks.get()] { return queue; };
  Running* raw = running.get();
  try {
    raw->thread = std::thread([raw] { raw->server.listen_after_bind(); });
  } catch (...) {
    tasks->shutdown();
    throw;
  }
  static_cast<void>(tasks.release());
  static_cast<void>(running.release());

  while (!raw->server.is_running()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  return raw;
}

void send(void* server, const std::string& json, const std::string& topic) {
  Events& events = static_cast<Running*>(server)->events;
  const std::string event = as_event(json);
  {
    const std::lock_guard lock(events.mutex);

    // New listeners get the latest of each topic
    if (!topic.empty()) events.kept[topic] = event;
    for (Listener& listener : events.listeners) put(listener, event);
  }
  events.news.notify_all();
}

void stop(void* server) {
  const std::unique_ptr<Running> running(static_cast<Running*>(server));

  // Open streams would keep the server running
  {
    const std::lock_guard lock(running->events.mutex);
    running->events.ended = true;
  }
  running->events.news.notify_all();
  running->server.stop();
  running->thread.join();
}

}  // namespace
}  // namespace plumbline::net

PLUMBLINE_PART(plumbline::net::HttpFunctions, &plumbline::net::start, &plumbline::net::send,
               &plumbline::net::stop)
