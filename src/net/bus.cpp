// SPDX-License-Identifier: BSD-3-Clause
#include "bus.hpp"

namespace plumbline::net {

core::Result<std::unique_ptr<RobotBus>> open_robot_bus(const NetworkOptions& options, const std::string& name,
                                                       const BusLog& log) {
  const auto& part = core::part<BusPart>();
  if (!part) return tl::unexpected(part.error());
  return (*part)->open_robot(options, name, log);
}

core::Result<int> days_of_keys(const NetworkOptions& options) {
  const auto& part = core::part<BusPart>();
  if (!part) return tl::unexpected(part.error());
  return (*part)->days_left(options.security);
}

core::Result<std::unique_ptr<HubBus>> open_hub_bus(const NetworkOptions& options, const BusLog& log) {
  const auto& part = core::part<BusPart>();
  if (!part) return tl::unexpected(part.error());
  return (*part)->open_hub(options, log);
}

}  // namespace plumbline::net
