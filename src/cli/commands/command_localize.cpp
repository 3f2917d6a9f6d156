// SPDX-License-Identifier: BSD-3-Clause
// plumbline localize MAP INPUT -o OUT
#include <memory>
#include <string>

#include "app.hpp"
#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/pipeline/map_recording.hpp"
#include "terminal/signals.hpp"

namespace plumbline::cli {
namespace {

/// Localises without changing the known map.
int localize(Session& session, pipeline::MapRequest request, const PublishRequest& publish) {
  if (auto equipped = session.equip(request); !equipped) return session.fail(equipped.error());
  prepare_live(request);
  if (auto prepared = prepare_publisher(session, publish, net::PublishedNames::kOfOne, "", request);
      !prepared)
    return session.fail(prepared.error());

  Console& console = session.console();
  const auto summary = pipeline::map_recording(request, session.executor(), console, stop_on_signals(),
                                               console.counting("frames"));
  return session.finish(summary, request.output);
}

}  // namespace

/// Options of localize.
void add_localize(CLI::App& app, Session& session) {
  const auto request = std::make_shared<pipeline::MapRequest>();
  const auto publish = std::make_shared<PublishRequest>();
  request->pipeline = "localize";
  publish->finished_map = true;
  CLI::App* command =
      add_command(app, session, "localize", "Locate a camera in a finished map, which stays as it is",
                  [&session, request, publish] { return localize(session, *request, *publish); });
  command->add_option("MAP", request->known_map, "Result folder of plumbline map, fuse or hub, or its map.db")
      ->required();
  command->add_option("INPUT", request->input, "A recording or a live camera, as for map")->required();
  command->add_option("-o,--output", request->output, "Folder for the result")->required()->type_name("OUT");
  add_frames_options(*command, *publish);
  add_recording_options(*command, *request);
  add_pipeline_options(*command, session, *request);
}

}  // namespace plumbline::cli
