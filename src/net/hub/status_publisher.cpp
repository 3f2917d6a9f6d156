// SPDX-License-Identifier: BSD-3-Clause
#include "hub/status_publisher.hpp"

#include <thread>

#include "plumbline/core/version.hpp"
#include "plumbline/maps/store.hpp"

namespace plumbline::net {
namespace {

using namespace std::chrono_literals;

constexpr auto kPublishHubEvery = 500ms;
constexpr auto kPublishHubEveryWhenStopped = 50ms;
constexpr int kFinalRepeats = 10;

}  // namespace

void StatusPublisher::publish(HubStatus status) const {
  status.store_format = maps::kStoreFormat;
  status.program = core::version();
  status.hub = id_;
  status.up_s = serving_since_ ? std::chrono::duration<double>(Clock::now() - *serving_since_).count() : -1.0;
  bus_.publish(status);
}

bool StatusPublisher::publish_presence() {
  if (Clock::now() - published_at_ < kPublishHubEvery) return false;
  publish({});
  published_at_ = Clock::now();
  return true;
}

/// Repeats the final statuses until robots have had time to receive them.
void StatusPublisher::publish_final(const std::vector<HubStatus>& statuses,
                                    const core::StopToken& stop) const {
  for (int i = 0; i < kFinalRepeats || !stop.stop_requested(); ++i) {
    for (const HubStatus& status : statuses) publish(status);
    bus_.poll_robots();
    std::this_thread::sleep_for(stop.stop_requested() ? kPublishHubEveryWhenStopped : kPublishHubEvery / 2);
  }
}

}  // namespace plumbline::net
