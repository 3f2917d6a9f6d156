// SPDX-License-Identifier: BSD-3-Clause
#include "hub/hub_feedback.hpp"

#include <utility>

namespace plumbline::net {
namespace {

using namespace std::chrono_literals;

/// Time between checks for changes: poses and landmarks change with every keyframe, and only the latest are
/// sent.
constexpr auto kCheckEvery = 2s;

}  // namespace

/// Selects the next transaction of a robot that shares a frame with this one.
void HubFeedback::select(Subscriber& to, const std::string& robot,
                         const std::map<std::string, RobotSession>& robots, const HubMeetings& meetings) {
  // Only robots whose common frame is known
  const std::string frame = meetings.frame(robot).frame_of;
  for (const auto& [name, other] : robots) {
    if (frame.empty() || name == robot || meetings.frame(name).frame_of != frame) continue;
    const std::int64_t head = other.copy().heads().map;
    std::int64_t& sent = to.heads[name];
    if (head < sent) sent = 0;  // the copy was emptied
    if (head == sent) continue;

    // One transaction at a time
    auto next = maps::next_transaction(other.file(), maps::StoreStream::kMap, sent);
    if (!next || !*next) continue;
    const std::int64_t number = (*next)->number;
    to.source = name;
    to.transaction.emplace(maps::StoreStream::kMap, std::exchange(sent, number), std::move(**next));
    to.index = 0;
    return;
  }

  to.next = Clock::now() + kCheckEvery;
}

void HubFeedback::step(const std::map<std::string, RobotSession>& robots, const HubMeetings& meetings,
                       HubBus& bus) {
  // A new reader begins with the first transaction
  for (const auto& [name, robot] : robots) {
    Subscriber& to = subscribers_[name];
    const int subscriptions = bus.feedback_subscriptions(name);
    if (subscriptions != to.subscriptions) to = {};
    to.subscriptions = subscriptions;
    if (subscriptions == 0) continue;

    // A full queue continues at the next step
    while (to.transaction && to.index < to.transaction->count()) {
      Chunk chunk = to.transaction->chunk(to.index);
      chunk.name = to.source;
      if (!bus.send_feedback(name, chunk)) break;
      ++to.index;
    }

    // The next transaction waits for the last chunk
    const bool sent = !to.transaction || to.index == to.transaction->count();
    if (sent && Clock::now() >= to.next) select(to, name, robots, meetings);
  }
}

}  // namespace plumbline::net
