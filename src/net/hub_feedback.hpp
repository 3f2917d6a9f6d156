// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What robots that ask for it are told of the others: the rows of the hub's copies, clouds left out, of those
// that lie in one frame with them. Each row once, and again when it has changed, a few seconds' changes at a
// time.
#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "hub_meetings.hpp"
#include "hub_robot.hpp"
#include "outbox.hpp"

namespace plumbline::net {

class HubFeedback {
 public:
  /// Sends what there is room for; to be called often.
  void step(const std::map<std::string, HubRobot>& robots, const HubMeetings& meetings, HubBus& bus);

 private:
  struct Listener {
    int begun = 0;                              ///< HubBus::begun_to_hear
    std::map<std::string, std::int64_t> heads;  ///< by robot: what was sent, up to this transaction
    std::string of;                             ///< whose rows are under way
    std::optional<Parcel> parcel;
    std::uint32_t index = 0;  ///< its next piece
    Clock::time_point next;   ///< time to look for more
  };
  static void choose(Listener& to, const std::string& robot, const std::map<std::string, HubRobot>& robots,
                     const HubMeetings& meetings);

  std::map<std::string, Listener> listeners_;
};

}  // namespace plumbline::net
