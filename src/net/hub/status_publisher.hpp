// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Publishes the hub's statuses under its identity.
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bus.hpp"
#include "plumbline/core/stop.hpp"

namespace plumbline::net {

class StatusPublisher {
 public:
  explicit StatusPublisher(HubBus& bus) : bus_(bus) {}
  void set_id(std::string id) { id_ = std::move(id); }
  [[nodiscard]] const std::string& id() const { return id_; }
  /// The hub serves from now on; before, it only looks for other hubs.
  void serve() { serving_since_ = Clock::now(); }
  void publish(HubStatus status) const;
  /// Publishes the hub's presence when it is due. True if it was published.
  bool publish_presence();
  /// Repeats the final statuses until `stop`, and often enough for their addressees to receive them.
  void publish_final(const std::vector<HubStatus>& statuses, const core::StopToken& stop) const;

 private:
  HubBus& bus_;
  std::string id_;  ///< made together with the result folder
  std::optional<Clock::time_point> serving_since_;
  Clock::time_point published_at_;
};

}  // namespace plumbline::net
