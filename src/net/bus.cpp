// SPDX-License-Identifier: BSD-3-Clause
#include "bus.hpp"

#include <fmt/format.h>

namespace plumbline::net {

core::Result<std::unique_ptr<RobotBus>> open_robot_bus(const NetworkOptions& options, const std::string& name,
                                                       const BusLog& log) {
  return core::part<BusPart>().and_then(
      [&](const BusPart* part) { return part->open_robot(options, name, log); });
}

core::Result<std::unique_ptr<HubBus>> open_hub_bus(const NetworkOptions& options, const BusLog& log) {
  return core::part<BusPart>().and_then([&](const BusPart* part) { return part->open_hub(options, log); });
}

core::Result<void> warn_of_security(const NetworkOptions& options, const std::string& danger,
                                    core::Log& log) {
  // Without keys anyone on the interface can take part
  if (options.security.empty()) {
    if (options.interface != "lo")
      log.warning(fmt::format("no --security on interface {}: {}", options.interface, danger));
    return {};
  }

  // Keys expire unnoticed during long deployments
  constexpr int kSoon = 30;  // days

  return core::part<BusPart>()
      .and_then([&](const BusPart* part) { return part->days_left(options.security); })
      .map([&](int days) {
        const std::string keys = options.security.string();
        if (days < 0) {
          log.warning(fmt::format("the keys in {} have expired; make new ones: plumbline keys create", keys));
        } else if (days < kSoon) {
          log.warning(fmt::format("the keys in {} expire in {} days", keys, days));
        }
      });
}

}  // namespace plumbline::net
