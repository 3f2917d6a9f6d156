// SPDX-License-Identifier: BSD-3-Clause
#include "hub_feedback.hpp"

#include <utility>

namespace plumbline::net {
namespace {

using namespace std::chrono_literals;

/// Poses and landmarks change with every keyframe: of what changed several times the last version is sent.
constexpr auto kChangesOf = 2s;

}  // namespace

void HubFeedback::choose(Listener& to, const std::string& robot,
                         const std::map<std::string, HubRobot>& robots, const HubMeetings& meetings) {
  const std::string frame = meetings.place(robot).frame_of;
  for (const auto& [name, other] : robots) {
    if (frame.empty() || name == robot || meetings.place(name).frame_of != frame) continue;
    const std::int64_t head = other.copy().heads().map;
    std::int64_t& sent = to.heads[name];
    if (head < sent) sent = 0;  // the copy was emptied
    if (head == sent) continue;
    auto next = maps::next_transaction(other.file(), maps::StoreShare::kMap, sent);
    if (!next || !*next) continue;
    const std::int64_t number = (*next)->number;
    to.of = name;
    to.parcel.emplace(maps::StoreShare::kMap, std::exchange(sent, number), std::move(**next));
    to.index = 0;
    return;
  }
  to.next = Clock::now() + kChangesOf;
}

void HubFeedback::step(const std::map<std::string, HubRobot>& robots, const HubMeetings& meetings,
                       HubBus& bus) {
  for (const auto& [name, robot] : robots) {
    Listener& to = listeners_[name];
    const int begun = bus.begun_to_hear(name);
    if (begun != to.begun) to = {};
    to.begun = begun;
    if (begun == 0) continue;
    while (to.parcel && to.index < to.parcel->count()) {
      Piece piece = to.parcel->piece(to.index);
      piece.name = to.of;
      if (!bus.tell(name, piece)) break;
      ++to.index;
    }
    const bool sent = !to.parcel || to.index == to.parcel->count();
    if (sent && Clock::now() >= to.next) choose(to, name, robots, meetings);
  }
}

}  // namespace plumbline::net
