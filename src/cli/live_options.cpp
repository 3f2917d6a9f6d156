// SPDX-License-Identifier: BSD-3-Clause
// Live cameras as the input of a command.
#include "app.hpp"
#include "plumbline/net/ros2.hpp"
#include "terminal/signals.hpp"

namespace plumbline::cli {

void add_live_options(CLI::App& command, pipeline::MapRequest& request) {
  dataset::LiveOptions& live = request.open.live;
  command
      .add_option("--for", live.for_s,
                  "Live camera: end this many seconds after its first frame (default: at Ctrl-C)")
      ->type_name("S")
      ->transform(
          CLI::AsNumberWithUnit(std::map<std::string, double>{{"s", 1.0}, {"min", 60.0}, {"h", 3600.0}},
                                CLI::AsNumberWithUnit::CASE_SENSITIVE, "TIME"))
      ->check(CLI::PositiveNumber);
  command
      .add_option("--record", live.record,
                  "Live camera: also write the mapped frames to this MCAP file, which gives the same bytes "
                  "when mapped")
      ->type_name("FILE.mcap");
}

void add_publish_option(CLI::App& command, std::string& address) {
  command
      .add_option("--publish", address,
                  "Publish the growing map on ROS 2's network, for RViz and others: /tf, paths, points "
                  "(docs/guide/inputs.md)")
      ->type_name("ros2://DOMAIN");
}

core::Result<void> prepare_publisher(Session& session, const std::string& address, net::PublishedNames names,
                                     const std::string& name, pipeline::RunRequest& request) {
  if (address.empty()) return {};
  auto publisher = net::open_ros2_publisher(address, names, name, session.console());
  if (!publisher) return tl::unexpected<core::Error>(publisher.error());
  request.observer = std::move(*publisher);
  return {};
}

void prepare_live(pipeline::MapRequest& request) {
  dataset::LiveOptions& live = request.open.live;
  live.open = &net::open_live_stream;
  live.stop = stop_on_signals();
  live.replace = request.replace;
}

}  // namespace plumbline::cli
