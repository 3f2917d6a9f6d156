// SPDX-License-Identifier: BSD-3-Clause
#include "live/live_stream.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace plumbline::dataset {
namespace {

using SteadyClock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kWaitForMessage(50);
constexpr std::size_t kReadAgain =
    128;  // frames behind the newest that was handed out; no more are under way
constexpr double kSilence_s = 5.0;

double seconds_since(SteadyClock::time_point then) {
  return std::chrono::duration<double>(SteadyClock::now() - then).count();
}

}  // namespace

LiveStream::LiveStream(std::unique_ptr<MessageStream> stream, LiveTopic color, LiveTopic depth,
                       Options options, core::Log& log)
    : stream_(std::move(stream)),
      color_(std::move(color)),
      depth_(std::move(depth)),
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

void LiveStream::number(const StampPairs::Pair& pair) {
  PairInfo info;
  info.stamp = seconds_of(pair.color.stamp_ns);
  info.depth_stamp = seconds_of(pair.depth.stamp_ns);
  const std::int64_t us = std::llrint(info.stamp * 1e6);
  const std::size_t bytes = pair.color.bytes->size() + pair.depth.bytes->size();

  std::unique_lock lock(mutex_);
  if (last_us_ && us <= *last_us_) {
    if (counts_.backwards++ == 0) {
      lock.unlock();
      log_.warning(fmt::format("{}: stamps go back at {:.6f}; frames are left out until they are later again",
                               options_.address, info.stamp));
    }
    return;
  }

  if (waiting_bytes_ + bytes > options_.most_waiting_bytes) {
    if (counts_.dropped++ == 0) {
      lock.unlock();
      log_.warning(
          fmt::format("{}: frames come faster than they are mapped, and {} MB of them wait: what comes "
                      "now is dropped",
                      options_.address, waiting_bytes_ >> 20U));
    }
    return;
  }

  last_us_ = us;
  last_taken_ = SteadyClock::now();
  const std::size_t index = infos_.size();
  if (index == 0) first_taken_ = last_taken_;
  info.color.number = info.depth.number = index;

  infos_.push_back(std::move(info));
  frames_[index] = {{pair.color.bytes, {}}, {pair.depth.bytes, {}}};
  waiting_bytes_ += bytes;
  ++counts_.taken;
  lock.unlock();
  changed_.notify_all();

  if (record_ != nullptr) {
    record_->add(pair);
  } else if (!started_) {
    to_record_.push_back(pair);
  }
}

bool LiveStream::wait_for_first(std::chrono::milliseconds most) {
  const auto until = SteadyClock::now() + most;
  while (size() == 0 && SteadyClock::now() < until && !options_.stop.stop_requested()) {
    auto message = stream_->next(kWaitForMessage);
    if (!message) continue;
    take({std::move(message->topic), message->received_ns,
          std::make_shared<const Bytes>(std::move(message->bytes))});
  }
  return size() > 0;
}

void LiveStream::start(std::unique_ptr<LiveRecord> record) {
  record_ = std::move(record);
  if (record_ != nullptr) {
    for (const StampPairs::Pair& pair : to_record_) record_->add(pair);
  }
  to_record_.clear();
  started_ = true;
  thread_ = std::make_unique<core::SideThread>([this](const core::StopToken& enough) { work(enough); });
}

void LiveStream::tell_silence() {
  const bool silent = seconds_since(last_taken_) > kSilence_s;
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

  while (!over()) {
    auto message = stream_->next(kWaitForMessage);
    if (message) {
      take({std::move(message->topic), message->received_ns,
            std::make_shared<const Bytes>(std::move(message->bytes))});
    }
    tell_silence();
  }

  while (const auto pair = pairs_.next(true)) number(*pair);
  const std::lock_guard lock(mutex_);
  counts_.lost = stream_->lost();
  counts_.unpaired = pairs_.unpaired();
  ended_ = true;
  changed_.notify_all();
}

std::size_t LiveStream::size() const {
  const std::lock_guard lock(mutex_);
  return infos_.size();
}

PairInfo LiveStream::info(std::size_t index) const {
  const std::lock_guard lock(mutex_);
  return infos_.at(index);
}

std::vector<PairInfo> LiveStream::infos() const {
  const std::lock_guard lock(mutex_);
  return infos_;
}

bool LiveStream::decided(std::size_t index) {
  const std::lock_guard lock(mutex_);
  if (!ended_ && infos_.size() <= index + 1) return false;
  for (; reached_ < std::min(index, infos_.size()); ++reached_) {
    const auto frame = frames_.find(reached_);
    if (frame != frames_.end()) waiting_bytes_ -= frame->second.size();
  }
  erase_unwanted();
  return true;
}

void LiveStream::erase_unwanted() {
  for (; forgotten_ + kReadAgain < reached_; ++forgotten_) {
    const auto frame = frames_.find(forgotten_);
    if (frame == frames_.end()) continue;
    if (frame->second.color.spot && frame->second.depth.spot) {
      frame->second.color.bytes.reset();
      frame->second.depth.bytes.reset();
    } else {
      frames_.erase(frame);
    }
  }
}

void LiveStream::wait_for(std::size_t index, std::chrono::milliseconds most) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, most, [&] { return ended_ || infos_.size() > index + 1; });
}

void LiveStream::keep(std::size_t index) {
  const std::lock_guard lock(mutex_);
  const auto frame = frames_.find(index);
  if (frame == frames_.end()) return;
  for (Image* image : {&frame->second.color, &frame->second.depth}) {
    if (image->spot || !image->bytes) continue;
    image->spot = kept_.add(*image->bytes);
    if (!image->spot) continue;
    if (image == &frame->second.depth) ++counts_.kept;
    counts_.kept_bytes += image->spot->size;
  }
}

std::string LiveStream::describe(ImageId id) const {
  return fmt::format("{}:{}#{}", options_.address, topic_of(id).topic.name, id.number);
}

core::Result<LiveStream::Message> LiveStream::message_of(ImageId id) const {
  const LiveTopic& topic = topic_of(id);
  Message message{topic.topic.type == "sensor_msgs/Image", topic.decoder, {}};
  const std::lock_guard lock(mutex_);
  const auto frame = frames_.find(id.number);
  const Image* image = frame == frames_.end()         ? nullptr
                       : id.list == ImageList::kColor ? &frame->second.color
                                                      : &frame->second.depth;
  if (image != nullptr && image->bytes) {
    message.bytes = *image->bytes;
    return message;
  }
  auto kept = image != nullptr && image->spot ? kept_.read(*image->spot) : std::nullopt;
  if (!kept) return core::input_error(describe(id) + ": has gone by");
  message.bytes = std::move(*kept);
  return message;
}

LiveCounts LiveStream::counts() const {
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
