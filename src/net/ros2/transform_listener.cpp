// SPDX-License-Identifier: BSD-3-Clause
#include "ros2/transform_listener.hpp"

#include <algorithm>
#include <cmath>
#include <thread>
#include <utility>

#include "plumbline/geometry/rigid3.hpp"

namespace plumbline::net {
namespace {

using geometry::Rigid3;
using std::chrono::milliseconds;

constexpr milliseconds kLook(50);
constexpr std::size_t kMost = 500;  // poses of the base, and own stamps, that are kept
constexpr double kNear_s = 0.5;

std::int64_t nanoseconds(double stamp) { return std::llround(stamp * 1e9); }

}  // namespace

TransformListener::TransformListener(std::unique_ptr<dataset::MessageStream> stream, std::string base)
    : stream_(std::move(stream)),
      base_(std::move(base)),
      thread_([this](const core::StopToken& stop) { listen(stop); }) {}

void TransformListener::listen(const core::StopToken& stop) {
  std::set<std::string> subscribed;
  while (!stop.stop_requested()) {
    // Publishers may start at any time
    for (const dataset::StreamTopic& topic : stream_->topics()) {
      const bool transforms = topic.name == "/tf" || topic.name == "/tf_static";
      if (transforms && topic.supported && subscribed.count(topic.name) == 0 &&
          stream_->subscribe(topic.name))
        subscribed.insert(topic.name);
    }
    if (const auto message = stream_->next(kLook)) take(*message);
  }
}

void TransformListener::take(const dataset::StreamMessage& message) {
  const auto transforms = dataset::read_transforms(message.bytes);
  if (!transforms) return;  // of another type, or damaged

  const std::lock_guard lock(mutex_);
  for (const auto& [stamp, transform] : *transforms) {
    if (message.topic == "/tf_static") {
      fixed_[transform.child] = transform;
      continue;
    }

    // Only others' poses of the base count
    if (transform.child != base_) continue;
    if (std::find(own_ns_.begin(), own_ns_.end(), nanoseconds(stamp)) != own_ns_.end()) continue;

    // Another parent frame has another origin
    if (transform.parent != parent_) moving_.clear();
    parent_ = transform.parent;
    moving_[stamp] = transform.parent_from_child;
    if (moving_.size() > kMost) moving_.erase(moving_.begin());
  }
}

std::optional<Rigid3> TransformListener::fixed(const std::string& parent, const std::string& child) const {
  Rigid3 frame_from_child;
  std::string frame = child;

  // A chain longer than all frames is a cycle
  for (std::size_t step = 0; frame != parent; ++step) {
    const auto found = fixed_.find(frame);
    if (found == fixed_.end() || step > fixed_.size()) return std::nullopt;
    frame_from_child = found->second.parent_from_child * frame_from_child;
    frame = found->second.parent;
  }
  return frame_from_child;
}

std::optional<Rigid3> TransformListener::wait_for(const std::string& parent, const std::string& child,
                                                  milliseconds most) const {
  const auto end = std::chrono::steady_clock::now() + most;
  while (true) {
    // The lock is free between attempts
    {
      const std::lock_guard lock(mutex_);
      if (auto found = fixed(parent, child)) return found;
    }
    if (std::chrono::steady_clock::now() >= end) return std::nullopt;
    std::this_thread::sleep_for(kLook);
  }
}

std::string TransformListener::other_parent() const {
  const std::lock_guard lock(mutex_);
  return parent_;
}

std::optional<Rigid3> TransformListener::base_at(double stamp) const {
  const std::lock_guard lock(mutex_);
  const auto after = moving_.lower_bound(stamp);

  // Poses are interpolated between neighbours in time
  if (after != moving_.end() && after != moving_.begin()) {
    const auto& [t0, from] = *std::prev(after);
    const auto& [t1, to] = *after;
    return geometry::interpolate(from, to, (stamp - t0) / (t1 - t0));
  }

  // At the ends the nearest pose must be near
  if (moving_.empty()) return std::nullopt;
  const auto& [nearest, pose] = after == moving_.end() ? *moving_.rbegin() : *after;
  return std::abs(nearest - stamp) <= kNear_s ? std::optional(pose) : std::nullopt;
}

void TransformListener::sends(double stamp) {
  const std::lock_guard lock(mutex_);
  own_ns_.push_back(nanoseconds(stamp));
  if (own_ns_.size() > kMost) own_ns_.pop_front();
}

}  // namespace plumbline::net
