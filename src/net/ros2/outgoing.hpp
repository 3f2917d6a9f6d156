// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Messages on their way to a sink, sent by a separate thread.
#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "plumbline/core/log.hpp"
#include "plumbline/core/side_thread.hpp"
#include "plumbline/dataset/message_stream.hpp"
#include "plumbline/dataset/ros_messages.hpp"

namespace plumbline::net {

/// post() returns at once and is thread-safe. If messages are sent too slowly, new ones are dropped and
/// counted, except those with must_go.
class Outgoing {
 public:
  struct Message {
    std::string topic;
    std::string type;
    std::function<dataset::MessageBytes()> bytes;  ///< made by the thread
    bool must_go = false;
  };

  Outgoing(std::unique_ptr<dataset::MessageSink> sink, core::Log& log);
  /// Waits a few seconds at most until the queued messages are sent.
  ~Outgoing();
  Outgoing(const Outgoing&) = delete;
  Outgoing& operator=(const Outgoing&) = delete;

  void post(Message message);

 private:
  void work();
  std::optional<Message> next();
  void send(const Message& message);

  std::unique_ptr<dataset::MessageSink> sink_;
  core::Log& log_;
  std::set<std::string> announced_;  ///< topics announced; used by the thread only
  bool told_problem_ = false;
  std::mutex mutex_;  ///< protects the members below
  std::condition_variable changed_;
  std::deque<Message> waiting_;
  std::size_t left_out_ = 0;
  bool closed_ = false;
  std::unique_ptr<core::SideThread> thread_;
};

}  // namespace plumbline::net
