// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Sends the maps of robots that share a frame to each of them that subscribes: rows of the hub's copies
// without clouds. Each row is sent once, and again after it has changed, a few seconds' changes at a time.
#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "chunked_transaction.hpp"
#include "hub/hub_meetings.hpp"
#include "hub/robot_session.hpp"

namespace plumbline::net {

class HubFeedback {
 public:
  /// Sends what the queues have room for; to be called often.
  void step(const std::map<std::string, RobotSession>& robots, const HubMeetings& meetings, HubBus& bus);

 private:
  struct Subscriber {
    int subscriptions = 0;                      ///< HubBus::feedback_subscriptions
    std::map<std::string, std::int64_t> heads;  ///< last transaction that was sent, by robot
    std::string source;                         ///< the robot whose rows are being sent
    std::optional<ChunkedTransaction> transaction;
    std::uint32_t index = 0;  ///< its next chunk
    Clock::time_point next;   ///< earliest time to look for changes
  };
  static void select(Subscriber& to, const std::string& robot,
                     const std::map<std::string, RobotSession>& robots, const HubMeetings& meetings);

  std::map<std::string, Subscriber> subscribers_;
};

}  // namespace plumbline::net
