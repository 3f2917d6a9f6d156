// SPDX-License-Identifier: BSD-3-Clause
// plumbline hub -o OUT
#include <memory>

#include "app.hpp"
#include "live_page.hpp"
#include "network_options.hpp"
#include "plumbline/net/hub.hpp"
#include "plumbline/pipeline/map_recording.hpp"
#include "terminal/signals.hpp"

namespace plumbline::cli {
namespace {

const char* const kTwoTerminals =
    "In one terminal:    plumbline hub -o building --robots 2 --interface lo\n"
    "In another one:     plumbline robot 'synth:room?frames=240&seed=1' --to 6 --name r0 --interface lo &\n"
    "                    plumbline robot 'synth:room?frames=240&seed=1' --from 2 --name r1 --interface lo\n"
    "Hub and robots may start in any order. More: docs/guide/network.md";

int hub(Session& session, net::HubRequest request, double quota_gb, const std::string& publish,
        const PageAddress& page) {
  // Limits and identity of the hub
  if (auto equipped = session.equip(request.fuse); !equipped) return session.fail(equipped.error());
  request.quota_bytes = static_cast<std::uint64_t>(quota_gb * 1e9);
  request.fresh_id = fresh_id();

  // A finished hub needs no network
  const auto finished =
      request.resume ? pipeline::is_finished(request.fuse.output, request.fuse.replace) : false;
  if (!finished) return session.fail(finished.error());
  if (*finished) {
    session.console().info(request.fuse.output.string() + ": is finished; there is nothing to continue");
    return 0;
  }

  // Publication and display
  if (auto prepared =
          prepare_publisher(session, {publish, {}, {}, 1}, net::PublishedNames::kOfEach, "", request.fuse);
      !prepared)
    return session.fail(prepared.error());

  // The page shows all robots
  Console& console = session.console();
  const auto live = live_map(page, request.fuse.output, console);
  if (!live) return session.fail(live.error());

  // Robots move when they meet
  if (*live) {
    request.placed = [&](const std::string& robot, const geometry::Rigid3& shared_from_robot) {
      (*live)->place(robot, shared_from_robot);
    };
  }

  // Status lines on the terminal and the page
  const auto summary = net::run_hub(
      request, session.executor(), console, stop_on_signals(),
      [&](const std::string& line) {
        console.status(line);
        if (*live) (*live)->tell(line);
      },
      console.counting("clouds"));

  return session.finish(summary, request.fuse.output);
}

}  // namespace

void add_hub(CLI::App& app, Session& session) {
  // Shared by the command and its options
  const auto request = std::make_shared<net::HubRequest>();
  const auto quota_gb = std::make_shared<double>(20.0);
  const auto publish = std::make_shared<std::string>();
  const auto page = std::make_shared<PageAddress>();
  CLI::App* command =
      add_command(app, session, "hub", "Collect the maps of robots over a network and fuse them",
                  [&session, request, quota_gb, publish, page] {
                    return hub(session, *request, *quota_gb, *publish, *page);
                  });

  // Output and number of robots
  command->footer(kTwoTerminals);
  command->add_option("-o,--output", request->fuse.output, "Folder for the result")
      ->required()
      ->type_name("OUT");
  command->add_option("--robots", request->robots, "Fuse when this many robots are done (default: at Ctrl-C)")
      ->type_name("N")
      ->check(CLI::Range(1, 64));

  // Network, publication and display
  add_network_options(*command, request->network);
  add_publish_option(*command, *publish);
  add_live_options(*command, *page);

  // Limits and the frame of the result
  command->add_option("--quota", *quota_gb, "Disk space for the map of each robot, GB (default: 20)")
      ->type_name("GB")
      ->check(CLI::PositiveNumber);
  command->add_option("--anchor", request->fuse.anchor, "Robot whose map defines the frame of the result")
      ->type_name("NAME");

  command
      ->add_option(
          "--into", request->fuse.into,
          "Finished map (result folder or map.db) that all robots visit, as for map; it stays as it is")
      ->type_name("MAP");

  // Interrupted hubs and pipelines
  command->add_flag("--resume", request->resume, "Continue an interrupted hub from OUT.partial");
  add_pipeline_options(*command, session, request->fuse);
}

}  // namespace plumbline::cli
