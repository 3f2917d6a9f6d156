// SPDX-License-Identifier: BSD-3-Clause
// plumbline robot INPUT --name NAME
#include <fmt/format.h>

#include <memory>
#include <string>

#include "app.hpp"
#include "network_options.hpp"
#include "plumbline/net/robot.hpp"
#include "terminal/signals.hpp"

namespace plumbline::cli {
namespace {

/// The summary, and the state of the delivery.
int finish(Session& session, const core::Result<net::RobotOutcome>& outcome,
           const std::filesystem::path& folder) {
  if (!outcome) return session.fail(outcome.error());
  const int code = outcome->summary ? session.finish(*outcome->summary, folder) : 0;
  if (outcome->delivered) {
    session.console().info("the hub has received everything");
  } else {
    session.console().warning(outcome->undelivered);
  }
  return code;
}

int robot(Session& session, net::RobotRequest request, const PublishRequest& publish) {
  // The robot's identity and its output
  if (auto equipped = session.equip(request.map); !equipped) return session.fail(equipped.error());
  prepare_live(request.map);
  if (auto prepared =
          prepare_publisher(session, publish, net::PublishedNames::kOfEach, request.name, request.map);
      !prepared)
    return session.fail(prepared.error());
  request.fresh_id = fresh_id();
  request.hand_in = fmt::format("--name {}{}", request.name, network_arguments(request.network));
  if (request.map.output.empty()) request.map.output = request.name;

  // An earlier run only needs to be sent
  const core::StopToken& stop = stop_on_signals();
  Console& console = session.console();
  const auto status = [&](const std::string& line) { console.status(line); };
  std::filesystem::path earlier = net::earlier_run(request.map.input);
  if (earlier.empty() && request.map.resume) {
    const auto finished = pipeline::is_finished(request.map.output, request.map.replace);
    if (!finished) return session.fail(finished.error());
    if (*finished) earlier = request.map.output;
  }

  // Only transmission is left to do
  if (!earlier.empty()) {
    const auto outcome = net::hand_in(request, earlier, console, stop, status);
    console.end_progress();
    return finish(session, outcome, earlier);
  }

  // Mapping and sending
  const auto outcome =
      net::run_robot(request, session.executor(), console, stop, status, console.counting("frames"));
  console.end_progress();
  return finish(session, outcome, request.map.output);
}

}  // namespace

void add_robot(CLI::App& app, Session& session) {
  // Shared by the command and its options
  const auto request = std::make_shared<net::RobotRequest>();
  request->map.pipeline = "robot";
  const auto publish = std::make_shared<PublishRequest>();

  // The command and how two terminals use it
  CLI::App* command =
      add_command(app, session, "robot", "Map a recording and send the map to a hub meanwhile",
                  [&session, request, publish] { return robot(session, *request, *publish); });
  command->footer(
      "Start a hub:        plumbline hub -o building --robots 1 --interface lo\n"
      "and a robot:        plumbline robot 'synth:room?frames=300&seed=1' --name r0 --interface lo\n"
      "or once more:       plumbline robot r0 --name r0 --interface lo   (sends the map in folder r0)\n"
      "Exit code 4: a hub has answered, but not received everything. More: docs/guide/network.md");

  // Input, name and output
  command
      ->add_option("INPUT", request->map.input,
                   "Recording, as for plumbline map; or the result folder of an earlier run, to send its map")
      ->required();
  command->add_option("--name", request->name, "Robot name, unique in the domain")
      ->required()
      ->type_name("NAME");
  command->add_option("-o,--output", request->map.output, "Folder for the result (default: NAME)")
      ->type_name("OUT");

  // Network, frames and feedback
  add_network_options(*command, request->network);
  add_frames_options(*command, *publish);
  command
      ->add_option_function<std::string>(
          "--feedback", [request](const std::string& choice) { request->feedback = choice == "on"; },
          "on: use maps of other robots for relocalisation and loops; the map then depends on the network "
          "(default: off)")
      ->check(CLI::IsMember({"off", "on"}));

  // Waiting times for the hub
  command
      ->add_option("--wait", request->wait_s,
                   "Seconds to wait after the last frame for a hub to answer at all (default: 30)")
      ->type_name("S")
      ->check(CLI::NonNegativeNumber);

  command
      ->add_option("--wait-lost", request->wait_lost_s,
                   "Seconds to wait since the hub's last acknowledgement (default: 600)")
      ->type_name("S")
      ->check(CLI::NonNegativeNumber);
  add_map_options(*command, session, request->map);
}

}  // namespace plumbline::cli
