// SPDX-License-Identifier: BSD-3-Clause
// Live cameras as the input of a command.
#include <cstdint>
#include <string>

#include "app.hpp"
#include "plumbline/net/ros2.hpp"
#include "terminal/signals.hpp"

namespace plumbline::cli {
namespace {

/// Bytes as text; a message if a queue of that size could not hold a few pairs of large images.
std::string queue_problem(const std::string& bytes) {
  constexpr std::uint64_t kLeastBytes = std::uint64_t{64} << 20U;
  return std::stoull(bytes) < kLeastBytes ? "give 64MB or more; a pair of images has up to 20MB" : "";
}

}  // namespace

/// Options of live cameras.
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

  // The frames, kept on disk and waiting in memory.
  command
      .add_option("--record", live.record,
                  "Live camera: also write the mapped frames to this MCAP file, which gives the same bytes "
                  "when mapped")
      ->type_name("FILE.mcap");
  command
      .add_option(
          "--max-memory", live.most_waiting_bytes,
          "Live camera: memory of the frames that wait to be mapped; what comes beyond is dropped and "
          "counted (default: 1GB)")
      ->type_name("SIZE")
      ->transform(CLI::AsSizeValue(false).description(""))
      ->check(queue_problem);
}

void add_publish_option(CLI::App& command, std::string& address) {
  command
      .add_option("--publish", address,
                  "Publish the growing map on ROS 2's network, for RViz and others: /tf, paths, points "
                  "(docs/reference/ros2.md)")
      ->type_name("ros2://DOMAIN");
}

/// Frames that the robot publishes.
void add_frames_options(CLI::App& command, PublishRequest& publish) {
  add_publish_option(command, publish.address);
  command
      .add_option(
          "--frames", publish.frames,
          "With --publish: names of frames on /tf, as they are: map, odom, base (the robot's base, above the "
          "camera by /tf_static) and camera (the colour camera's optical frame)")
      ->type_name("base=base_link,...");

  // Both have an effect only if the robot's base is named.
  command
      .add_option("--odom-tf", publish.odom_tf,
                  "With a base: odom -> base is published by us (own), by somebody else (other), or by us "
                  "unless somebody else is heard (auto)")
      ->transform(one_of<net::OdomTf>(
          {{"own", net::OdomTf::kOwn}, {"other", net::OdomTf::kOther}, {"auto", net::OdomTf::kAuto}}))
      ->type_name("own|other|auto");
  command
      .add_option("--grid-heights", publish.grid_heights,
                  "With a base: heights over its origin, in metres, between which things are obstacles in "
                  "the occupancy grid")
      ->type_name("LOW,HIGH")
      ->delimiter(',')
      ->expected(2);
}

core::Result<void> prepare_publisher(Session& session, const PublishRequest& publish,
                                     net::PublishedNames names, const std::string& name,
                                     pipeline::RunRequest& request) {
  // Frames without an address have no effect
  if (publish.address.empty()) {
    if (publish.frames.empty()) return {};
    return core::usage_error("--frames names what --publish ros2://DOMAIN sends; give that too");
  }

  // Names of frames belong to one robot
  auto frames = net::parse_published_frames(publish.frames);
  if (!frames) return tl::unexpected<core::Error>(frames.error());
  if (frames->given() && publish.robots > 1) {
    return core::usage_error(
        "--frames: names are those of one robot; map each recording in a run of its own, or leave it out: "
        "frames then begin with the robots' names");
  }

  // The publisher observes the run
  frames->odom_tf = publish.odom_tf;
  frames->finished_map = publish.finished_map;
  frames->grid_heights = {publish.grid_heights[0], publish.grid_heights[1]};
  if (publish.grid_heights[0] >= publish.grid_heights[1])
    return core::usage_error("--grid-heights: takes two heights, the lower first");
  auto publisher = net::open_ros2_publisher(publish.address, names, name, *frames, session.console());
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
