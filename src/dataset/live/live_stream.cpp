// SPDX-License-Identifier: BSD-3-Clause
#include "live/live_stream.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace plumbline::dataset {
namespace {

using SteadyClock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kWaitForMessage(50);
constexpr double kSilence_s = 5.0;

double seconds_since(SteadyClock::time_point then) {
  return std::chrono::duration<double>(SteadyClock::now() - then).count();
}

}  // namespace

LiveStream::LiveStream(std::unique_ptr<MessageStream> stream, LiveTopic color, LiveTopic depth,
                       std::shared_ptr<LiveQueue> queue, Options options, core::Log& log)
    : stream_(std::move(stream)),
      color_(std::move(color)),
      depth_(std::move(depth)),
      queue_(std::move(queue)),
      options_(std::move(options)),
      log_(log),
      pairs_(options_.max_pair_gap_s, options_.depth_delay_s),
      first_taken_(SteadyClock::now()),
      last_taken_(first_taken_) {}

LiveStream::~LiveStream() = default;

void LiveStream::add(const LiveMessage& message) { take(message); }

void LiveStream::take(const LiveMessage& message) {
  const bool color = message.topic == color_.topic.name;
  if (!color && message.topic != depth_.topic.name) {
    const auto told = std::find_if(options_.body.begin(), options_.body.end(),
                                   [&](const BagTopic& topic) { return topic.name == message.topic; });
    const std::lock_guard lock(mutex_);
    if (told != options_.body.end()) body_.add(*told, *color_.decoder, *message.bytes);
    return;
  }

  const MessageDecoder& decoder = color ? *color_.decoder : *depth_.decoder;
  const auto stamp = decoder.stamp(message.bytes->data(), std::min(message.bytes->size(), kHeadBytes));
  if (!stamp) return;
  // Drivers without a clock leave the stamp out.
  const std::int64_t stamp_ns = *stamp != 0 ? *stamp : message.received_ns;
  StampPairs::Stamped image{stamp_ns, message.received_ns, message.bytes};

  if (color) {
    pairs_.add_color(std::move(image));
  } else {
    pairs_.add_depth(std::move(image));
  }
  while (const auto pair = pairs_.next(false)) number(*pair);
}

void LiveStream::leave_out(std::size_t LiveReport::*count, const std::string& why) {
  std::unique_lock lock(mutex_);
  const bool first = (counts_.*count)++ == 0;
  lock.unlock();
  if (first) log_.warning(fmt::format("{}: {}", options_.address, why));
}

void LiveStream::number(const StampPairs::Pair& pair) {
  // The frame gets a number in the queue, or is left out for a reason
  const double stamp = seconds_of(pair.color.stamp_ns);
  switch (queue_->push({stamp, seconds_of(pair.depth.stamp_ns), pair.color.bytes, pair.depth.bytes})) {
    case LiveQueue::Answer::kTaken:
      break;
    case LiveQueue::Answer::kEnded:
      return;

    case LiveQueue::Answer::kBackwards:
      return leave_out(
          &LiveReport::backwards,
          fmt::format("stamps go back at {:.6f}; frames are left out until they are later again", stamp));
    case LiveQueue::Answer::kFull:
      return leave_out(&LiveReport::dropped,
                       fmt::format("frames come faster than they are mapped, and {} MB of them wait: what "
                                   "comes now is dropped",
                                   options_.most_waiting_bytes >> 20U));
  }

  // The record has the frames that have numbers, in their order.
  last_taken_ = SteadyClock::now();
  if (queue_->size() == 1) first_taken_ = last_taken_;
  if (record_ != nullptr) {
    record_->add(pair);
  } else if (!started_) {
    to_record_.push_back(pair);
  }
}

/// Takes messages until the first pair is complete; false if none came within `most`.
bool LiveStream::wait_for_first(std::chrono::milliseconds most) {
  const auto until = SteadyClock::now() + most;
  while (queue_->size() == 0 && SteadyClock::now() < until && !options_.stop.stop_requested()) {
    auto message = stream_->next(kWaitForMessage);
    if (!message) continue;
    take({std::move(message->topic), message->received_ns,
          std::make_shared<const Bytes>(std::move(message->bytes))});
  }
  return queue_->size() > 0;
}

void LiveStream::start(std::unique_ptr<LiveRecord> record) {
  record_ = std::move(record);

  // The recording begins with the pairs already received
  if (record_ != nullptr) {
    for (const StampPairs::Pair& pair : to_record_) record_->add(pair);
  }
  to_record_.clear();
  started_ = true;
  thread_ = std::make_unique<core::SideThread>([this](const core::StopToken& enough) { work(enough); });
}

void LiveStream::tell_silence() {
  const bool silent = seconds_since(last_taken_) > kSilence_s;

  // One warning for each silence
  if (silent && !told_silence_) {
    log_.warning(fmt::format("{}: no frame for {:g} s; waiting for the camera (Ctrl-C ends the run)",
                             options_.address, kSilence_s));
  }
  told_silence_ = silent;
}

void LiveStream::work(const core::StopToken& enough) {
  const auto over = [&] {
    return enough.stop_requested() || options_.stop.stop_requested() ||
           seconds_since(first_taken_) > options_.for_s;
  };

  // Short waits, so that silence is noticed
  while (!over()) {
    auto message = stream_->next(kWaitForMessage);
    if (message) {
      take({std::move(message->topic), message->received_ns,
            std::make_shared<const Bytes>(std::move(message->bytes))});
    }
    tell_silence();
  }

  // Images that still wait for their pair
  while (const auto pair = pairs_.next(true)) number(*pair);

  // Last counts before readers see the end
  std::unique_lock lock(mutex_);
  counts_.lost = stream_->lost();
  counts_.unpaired = pairs_.unpaired();
  lock.unlock();
  queue_->end();
}

LiveReport LiveStream::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

BodyReadings LiveStream::body_readings(double imu_after, double odometry_after, double until) const {
  const std::lock_guard lock(mutex_);
  return readings_between(body_.imu(), body_.odometry(), imu_after, odometry_after, until);
}

std::string LiveStream::body_frame() const {
  const std::lock_guard lock(mutex_);
  return body_.body_frame();
}

core::Result<void> LiveStream::finish() {
  thread_.reset();
  if (record_ == nullptr) return {};
  const auto finished = record_->finish();
  record_.reset();
  return finished;
}

}  // namespace plumbline::dataset
