// SPDX-License-Identifier: BSD-3-Clause
// plumbline fuse MAP MAP... -o OUT
#include <fmt/format.h>

#include <memory>

#include "app.hpp"
#include "plumbline/pipeline/fuse_maps.hpp"
#include "terminal/signals.hpp"

namespace plumbline::cli {
namespace {

constexpr std::size_t kMaxMaps = 255;

/// Fuses the maps and prints the summary.
int fuse(Session& session, pipeline::FuseRequest request) {
  if (request.maps.size() > kMaxMaps) {
    return session.fail(
        core::usage_error(fmt::format("MAP: give at most {} maps at once, and fuse the results", kMaxMaps))
            .value());
  }
  if (auto equipped = session.equip(request); !equipped) return session.fail(equipped.error());
  Console& console = session.console();
  const auto summary = pipeline::fuse_stored_maps(request, session.executor(), console, stop_on_signals(),
                                                  console.counting("clouds"));
  return session.finish(summary, request.output);
}

}  // namespace

/// Options of fuse.
void add_fuse(CLI::App& app, Session& session) {
  const auto request = std::make_shared<pipeline::FuseRequest>();
  CLI::App* command =
      add_command(app, session, "fuse", "Merge finished maps of several robots into one frame",
                  [&session, request] { return fuse(session, *request); });
  command
      ->add_option("MAP", request->maps,
                   "Result folders of plumbline map or fuse; their order does not matter")
      ->required()
      ->expected(2, CLI::detail::expected_max_vector_size);
  command->add_option("-o,--output", request->output, "Folder for the result")->required()->type_name("OUT");
  command
      ->add_option("--anchor", request->anchor,
                   "Robot whose map defines the frame of the result (default: the one with the largest map)")
      ->type_name("NAME");
  add_pipeline_options(*command, session, *request);
}

}  // namespace plumbline::cli
