// SPDX-License-Identifier: BSD-3-Clause
// plumbline synth SCENE -o DIR
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <system_error>

#include "app.hpp"
#include "option_flags.hpp"
#include "plumbline/synth/layout.hpp"
#include "plumbline/synth/recording.hpp"
#include "terminal/print.hpp"
#include "terminal/signals.hpp"

namespace plumbline::cli {
namespace {

struct SynthRequest {
  std::string scene;
  std::filesystem::path output;
  synth::SynthOptions options;
  OptionFlags flags;
};

core::Result<void> film(SynthRequest& request, Session& session) {
  // Options and scene
  if (auto applied = request.flags.apply(); !applied) return applied;
  if (auto checked = synth::check(request.options); !checked) return checked;
  const auto pipelines = session.pipelines_folder();
  if (!pipelines) return tl::unexpected<core::Error>(pipelines.error());
  const auto scene = synth::open_scene(request.scene, request.options, *pipelines / "scenes");
  if (!scene) return tl::unexpected<core::Error>(scene.error());

  // Recordings are never overwritten
  std::error_code ec;
  if (std::filesystem::exists(request.output, ec) && !std::filesystem::is_empty(request.output, ec)) {
    return core::usage_error(
        fmt::format("{}: exists and is not empty; name a new folder", request.output.string()));
  }

  // Cameras film the scene
  Console& console = session.console();
  const auto summary = synth::write_recordings({*scene, request.options, request.output}, session.executor(),
                                               stop_on_signals(), console, console.counting("frames"));
  console.end_progress();
  if (!summary) return tl::unexpected<core::Error>(summary.error());

  // Coverage by the cameras
  if (!session.quiet) {
    if (summary->openings > 0) {
      print("the cameras saw {:.0f} % of all surface, and the jambs of {} of {} openings\n",
            100.0 * static_cast<double>(summary->reference_visible) /
                static_cast<double>(std::max<std::size_t>(1, summary->reference_samples)),
            summary->openings_seen, summary->openings);
    }

    print("{}{} robots, {} frames, {:.1f} m of path, {} reference points in {}\n",
          summary->stopped ? "stopped early: " : "", summary->robots, summary->frames, summary->path_m,
          summary->reference_samples, request.output.string());
  }
  return {};
}

}  // namespace

/// Options of synth.
void add_synth(CLI::App& app, Session& session) {
  const auto request = std::make_shared<SynthRequest>();
  CLI::App* command =
      add_command(app, session, "synth", "Film a generated world: recordings with exact truth",
                  [&session, request] { return film(*request, session); });
  command->add_option("SCENE", request->scene, "Shipped scene or file")->required();
  command->add_option("-o,--output", request->output, "Folder for the recordings")
      ->required()
      ->type_name("DIR");
  add_progress_option(*command, session);
  request->flags.add(*command, request->options);
}

}  // namespace plumbline::cli
