// SPDX-License-Identifier: BSD-3-Clause
// plumbline play RECORDING ros2://DOMAIN
#include <fmt/format.h>

#include <memory>
#include <string>

#include "app.hpp"
#include "plumbline/dataset/play.hpp"
#include "plumbline/net/ros2.hpp"
#include "plumbline/pipeline/input.hpp"
#include "terminal/print.hpp"
#include "terminal/signals.hpp"

namespace plumbline::cli {
namespace {

struct PlayRequest {
  std::string input;
  std::string address;
  dataset::OpenOptions open;
  dataset::PlayOptions play;
};

core::Result<void> play(Session& session, PlayRequest& request) {
  // The address without topics
  const auto address = net::parse_ros2_address(request.address);
  if (!address) return tl::unexpected<core::Error>(address.error());
  if (address->topics.any()) {
    return core::usage_error(
        fmt::format("{}: topics cannot be named here: they are those of a camera's node", request.address));
  }

  // The recording with its calibration
  const auto pipelines = session.pipelines_folder();
  if (!pipelines) return tl::unexpected<core::Error>(pipelines.error());
  request.open.cameras_folder = *pipelines / "cameras";
  Console& console = session.console();
  const auto source =
      pipeline::open_input(request.input, request.open, *pipelines / "scenes", session.executor(), console);
  if (!source) return tl::unexpected<core::Error>(source.error());

  // A camera's node on the network
  const auto sink = net::open_ros2_sink(*address);
  if (!sink) return tl::unexpected<core::Error>(sink.error());

  // Until the end or Ctrl-C
  request.play.stop = stop_on_signals();
  request.play.progress = console.counting("frames");
  const auto summary = dataset::play_recording(**source, **sink, request.play, console);
  console.end_progress();

  // Late and unreadable frames are reported
  if (!summary) return tl::unexpected<core::Error>(summary.error());
  if (summary->unreadable > 0)
    console.warning(fmt::format("{} frames cannot be read and were left out", summary->unreadable));
  if (!session.quiet)
    print("published  {} frames, none later than {:.0f} ms after it was due\n", summary->published,
          summary->late_s * 1000.0);
  return {};
}

}  // namespace

void add_play(CLI::App& app, Session& session) {
  const auto request = std::make_shared<PlayRequest>();
  CLI::App* command =
      add_command(app, session, "play", "Publish a recording on ROS 2's network as a camera would",
                  [&session, request] { return play(session, *request); });
  command->footer(
      "In one terminal:    plumbline map 'ros2://7?interface=lo' -o live --for 20s\n"
      "In another one:     plumbline play RECORDING 'ros2://7?interface=lo' --loop\n"
      "ROS 2 itself is not needed. More: docs/guide/inputs.md");

  // Recording and address
  command->add_option("INPUT", request->input, "A recording, as for plumbline map")->required();
  command->add_option("ADDRESS", request->address, "ros2://DOMAIN[?interface=IF&peers=HOST,...]")->required();
  command
      ->add_option("--pace", request->play.pace_hz, "Frames per second (default: by the recording's stamps)")
      ->type_name("HZ")
      ->check(CLI::Range(0.01, 1000.0));

  // Repetition and the first subscriber
  command->add_flag("--loop", request->play.loop,
                    "Start again after the last frame, until Ctrl-C; stamps continue");
  command
      ->add_option("--wait", request->play.wait_s,
                   "Seconds to wait for a subscriber before the first frame (default: 10)")
      ->type_name("S")
      ->check(CLI::NonNegativeNumber);

  // Layout and camera of the recording
  command->add_option("--camera", request->open.camera, "Shipped calibration or file")
      ->type_name("NAME|FILE");
  command->add_option("--format", request->open.format, "Layout of INPUT (default: auto)")
      ->check(CLI::IsMember(dataset::layout_names()));
  add_topic_option(*command, request->open);
  add_time_range(*command, request->open);
  command->add_option("--every", request->open.every, "Use every N-th frame")
      ->type_name("N")
      ->check(CLI::Range(1, 100000));
}

}  // namespace plumbline::cli
