// SPDX-License-Identifier: BSD-3-Clause
#include "ros2/outgoing.hpp"

#include <fmt/format.h>

#include <utility>

namespace plumbline::net {
namespace {

constexpr std::size_t kMostWaiting = 200;                // messages
constexpr std::chrono::milliseconds kLastWords(10'000);  // for listeners to get the cloud

}  // namespace

Outgoing::Outgoing(std::unique_ptr<dataset::MessageSink> sink, core::Log& log)
    : sink_(std::move(sink)), log_(log) {
  thread_ = std::make_unique<core::SideThread>([this](const core::StopToken& /*enough*/) { work(); });
}

Outgoing::~Outgoing() {
  {
    const std::lock_guard lock(mutex_);
    closed_ = true;
  }

  // Waiting messages are still sent
  changed_.notify_all();
  thread_.reset();
  sink_->flush(kLastWords);
  if (left_out_ > 0)
    log_.warning(fmt::format("{} messages were not published: listeners are too slow", left_out_));
}

void Outgoing::post(Message message) {
  {
    const std::lock_guard lock(mutex_);

    // Slow subscribers must not use up memory
    if (waiting_.size() >= kMostWaiting && !message.must_go) {
      ++left_out_;
      return;
    }
    waiting_.push_back(std::move(message));
  }
  changed_.notify_all();
}

/// Waits for the next message; none once closed and empty.
std::optional<Outgoing::Message> Outgoing::next() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return closed_ || !waiting_.empty(); });
  if (waiting_.empty()) return std::nullopt;
  Message message = std::move(waiting_.front());
  waiting_.pop_front();
  return message;
}

void Outgoing::send(const Message& message) {
  core::Result<void> sent;

  // Topics appear with their first message
  if (announced_.count(message.topic) == 0) {
    sent = sink_->announce(message.topic, message.type, dataset::Retention::kLatest);
    if (sent) announced_.insert(message.topic);
  }
  if (sent) {
    const auto bytes = message.bytes();
    sent = bytes ? sink_->send(message.topic, *bytes) : tl::unexpected(bytes.error());
  }

  // One warning for all messages
  if (sent || std::exchange(told_problem_, true)) return;
  log_.warning(fmt::format("the map is not published: {}", sent.error().message));
}

void Outgoing::work() {
  while (const auto message = next()) send(*message);
}

}  // namespace plumbline::net
