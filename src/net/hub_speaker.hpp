// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The hub's words, and the name in which it says them.
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bus.hpp"
#include "plumbline/core/stop.hpp"

namespace plumbline::net {

class HubSpeaker {
 public:
  explicit HubSpeaker(HubBus& bus) : bus_(bus) {}
  void set_id(std::string id) { id_ = std::move(id); }
  [[nodiscard]] const std::string& id() const { return id_; }
  /// From now on it serves; before it only looks for others.
  void serve() { serving_since_ = Clock::now(); }
  void say(Word word) const;
  /// That it is there, when it is time to say so again. True: it was.
  bool say_presence();
  /// These words, as often as who they are for may need them, until `stop`.
  void say_goodbye(const std::vector<Word>& words, const core::StopToken& stop) const;

 private:
  HubBus& bus_;
  std::string id_;  ///< made with the result folder
  std::optional<Clock::time_point> serving_since_;
  Clock::time_point said_at_;
};

}  // namespace plumbline::net
