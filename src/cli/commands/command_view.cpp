// SPDX-License-Identifier: BSD-3-Clause
// plumbline view OUT [OTHER]
#include <fmt/format.h>
#include <pthread.h>

#include <csignal>
#include <cstdio>
#include <memory>

#include "app.hpp"
#include "plumbline/exports/view.hpp"
#include "plumbline/net/page_server.hpp"
#include "plumbline/viewer/page.hpp"
#include "recording_opener.hpp"
#include "terminal/print.hpp"

namespace plumbline::cli {
namespace {

struct ViewCommand {
  exports::ExportRequest request;
  std::filesystem::path other;
  std::string http = "127.0.0.1:8080";
  std::string token;
};

core::Result<void> run_view(ViewCommand& command, Session& session) {
  // The address must be free before the long work
  const auto options = net::page_server_options(command.http, command.token);
  if (!options) return tl::unexpected<core::Error>(options.error());
  if (auto free = net::check_listening(*options); !free) return free;
  Console& console = session.console();
  if (const std::string warning = net::open_to_others(*options); !warning.empty()) console.warning(warning);
  command.request.open = recording_opener(session);
  exports::ExportRequest other = command.request;
  other.input = command.other;

  // One result, or two in one view
  auto view = command.other.empty()
                  ? exports::view_of(command.request, session.executor(), console, console.counting("views"))
                  : exports::view_of_two(command.request, other, session.executor(), console,
                                         console.counting("views"));
  console.end_progress();
  if (!view) return tl::unexpected<core::Error>(view.error());
  for (const std::string& note : view->notes) console.info(note);

  // From here on Ctrl-C ends it; the server's threads leave the signals to this one.
  sigset_t ends;
  sigemptyset(&ends);
  sigaddset(&ends, SIGINT);
  sigaddset(&ends, SIGTERM);
  sigaddset(&ends, SIGHUP);
  pthread_sigmask(SIG_BLOCK, &ends, nullptr);

  // The page is served until a signal
  auto server = net::PageServer::start(*options, viewer::page(view->scene, exports::kViewGenerator));
  if (!server) return tl::unexpected<core::Error>(server.error());
  print("{}\n", server->address());
  std::fflush(stdout);
  int signal = 0;
  sigwait(&ends, &signal);
  return {};
}

}  // namespace

void add_view(CLI::App& app, Session& session) {
  const auto state = std::make_shared<ViewCommand>();
  CLI::App* command =
      add_command(app, session, "view", "Show a map in the browser, to walk through and measure in",
                  [&session, state] { return run_view(*state, session); });
  command->add_option("OUT", state->request.input, "A result folder, map.db, or a cloud file")->required();
  command->add_option("OTHER", state->other, "Second result, shown over the first");

  // Where it is served, and how much of it.
  command
      ->add_option("--http", state->http,
                   "Address to serve the page at, until Ctrl-C (default: 127.0.0.1:8080)")
      ->type_name("HOST:PORT");
  command
      ->add_option("--http-token", state->token,
                   "Token that every browser must present; it is part of the address that is printed")
      ->type_name("TEXT");

  // Points of the map
  command
      ->add_option("--points", state->request.options.points,
                   "Largest number of points, thinned by voxels; 0: all (default: 1500000)")
      ->type_name("N");
}

}  // namespace plumbline::cli
