// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The hub as a robot knows it from the statuses it receives.
#include <cstdint>
#include <string>

#include "bus.hpp"
#include "plumbline/core/log.hpp"

namespace plumbline::net {

/// State of the link to the hub, for the program and its user.
struct LinkStatus {
  bool found = false;       ///< a hub has answered at least once
  bool connected = false;   ///< a status of it came in the last seconds
  bool done = false;        ///< it has confirmed that it holds everything
  std::string refused;      ///< why it will never accept this run; empty: it was not refused
  std::string problem;      ///< why it cannot store rows at present
  std::string location;     ///< pose in the shared frame as text; empty: this robot has met no other
  std::int64_t behind = 0;  ///< number of transactions not acknowledged
  std::uint64_t sent_bytes = 0;
  std::uint64_t resent_bytes = 0;             ///< included in sent_bytes
  Clock::time_point progress = Clock::now();  ///< time of the last acknowledgement, or the link's start
};

class HubSession {
 public:
  explicit HubSession(core::Log& log) : log_(log) {}

  /// Applies a received status; `robot` is this robot's own. True: it is from another hub than before, which
  /// has received nothing yet.
  bool apply(const HubStatus& hub, const RobotStatus& robot);
  /// Warns once when no hub has answered for 10 s.
  void report_silence(RobotBus& bus);
  /// Drops the last answer, when the robot starts a new incarnation.
  void reset() { hub_ = {}; }
  [[nodiscard]] const HubStatus& hub() const { return hub_; }  ///< last answer to this incarnation
  [[nodiscard]] Clock::time_point received_at() const { return received_at_; }
  /// True if the hub is connected and accepts chunks.
  [[nodiscard]] bool accepts() const;
  /// Status without the counts of sent data.
  [[nodiscard]] LinkStatus status() const;

 private:
  bool select(const HubStatus& hub);
  void apply_answer(const HubStatus& hub, bool finished);
  void report_frame(const SharedFrame& frame, const std::string& name);

  core::Log& log_;
  Clock::time_point started_ = Clock::now();
  std::string id_;                 ///< id of the hub
  Clock::time_point received_at_;  ///< last status of that hub
  HubStatus hub_;
  LinkStatus status_;
  bool silence_reported_ = false;
  bool other_hub_reported_ = false;
};

}  // namespace plumbline::net
