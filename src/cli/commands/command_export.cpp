// SPDX-License-Identifier: BSD-3-Clause
// plumbline export MAP -o FILE|FOLDER
#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "app.hpp"
#include "option_flags.hpp"
#include "plumbline/exports/export.hpp"
#include "plumbline/maps/output_check.hpp"
#include "plumbline/maps/stored_run.hpp"
#include "recording_opener.hpp"
#include "terminal/print.hpp"
#include "terminal/silenced_stdio.hpp"

namespace plumbline::cli {
namespace {

struct ExportCommand {
  exports::ExportRequest request;
  std::string what = "cloud";
  bool trajectory = false;
  bool lines = false;
  bool mesh = false;
  bool page = false;                ///< docs/guide/exports.md, and nothing else
  std::filesystem::path keyframes;  ///< folder for the clouds of keyframes; empty: none
  OptionFlags flags;
};

exports::Content content_of(const ExportCommand& command) {
  if (command.mesh) return exports::Content::kMesh;
  if (command.trajectory || command.what == "trajectory") return exports::Content::kTrajectory;
  if (command.what == "keyframes") return exports::Content::kKeyframes;
  if (command.lines || command.what == "lines") return exports::Content::kLines;
  return exports::Content::kCloud;
}

/// One cloud per keyframe, from the store.
core::Result<void> export_keyframes(const ExportCommand& command) {
  if (auto free = maps::check_output(command.keyframes, {}); !free) return free;
  auto place = maps::find_map(command.request.input);
  if (!place) return tl::unexpected<core::Error>(place.error());
  if (place->store.empty()) {
    return core::usage_error(fmt::format(
        "--keyframes: {} has no map.db with the clouds of keyframes; map again with a pipeline that tracks "
        "and without store.enabled=off",
        command.request.input.string()));
  }
  place->robot = command.request.robot;
  const auto stored = maps::StoredRun::open_main(*place);
  if (!stored) return tl::unexpected<core::Error>(stored.error());
  const auto count = stored->write_keyframe_clouds(command.keyframes);
  if (!count) return tl::unexpected<core::Error>(count.error());
  return {};
}

core::Result<void> run_export(ExportCommand& command, Session& session) {
  // The page needs no map
  if (command.page) {
    print("{}", exports::exports_page());
    return {};
  }

  // Input and at least one output
  exports::ExportRequest& request = command.request;
  if (request.input.empty())
    return core::usage_error("MAP is required: a result folder, map.db, or a cloud file");
  if (auto applied = command.flags.apply(); !applied) return applied;
  if (request.output.empty() && command.keyframes.empty())
    return core::usage_error("no output is named; name a file with -o or a folder with --keyframes");

  // Keyframes, alone or with a file
  if (!command.keyframes.empty()) {
    auto done = export_keyframes(command);
    if (!done || request.output.empty()) return done;
  }

  // Content, options and pictures of the export
  request.content = content_of(command);
  request.given = command.flags.given();
  request.open = recording_opener(session);
  request.quietly = [](const std::function<void()>& work) {
    const SilencedStdio silenced;
    work();
  };

  // The export itself
  Console& console = session.console();
  auto summary = exports::write_export(request, session.executor(), console, console.counting("views"));
  console.end_progress();
  if (!summary) return tl::unexpected<core::Error>(summary.error());
  for (const std::string& note : summary->notes) console.info(note);
  return {};
}

/// The table of formats as --help shows it.
std::string formats_help() {
  std::string text = "Formats (by the ending of the output, or --format):\n";
  for (const exports::FormatInfo& format : exports::export_formats()) {
    std::string options;
    for (std::string key : format.options) {
      std::replace(key.begin(), key.end(), '_', '-');
      options += " --" + key;
    }
    text += fmt::format("  {:<11} {:<16} {}{}\n{}", format.name, format.endings, format.title,
                        format.needs.empty() ? "" : fmt::format(" (needs {})", format.needs),
                        options.empty() ? "" : fmt::format("  {:<28} {}\n", "", options.substr(1)));
  }
  return text +
         "--box, --z and --storey choose a part of the map for every format. More: docs/guide/exports.md";
}

}  // namespace

void add_export(CLI::App& app, Session& session) {
  const auto state = std::make_shared<ExportCommand>();
  CLI::App* command = add_command(app, session, "export", "Write a map in formats of other programs",
                                  [&session, state] { return run_export(*state, session); });

  // Input, output and format
  exports::ExportRequest& request = state->request;
  command->add_option("MAP", request.input,
                      "Result folder (of an interrupted run, too), map.db, or cloud file");
  command
      ->add_option("-o,--output", request.output,
                   "File to write, or a folder for formats that consist of several files")
      ->type_name("FILE|FOLDER");

  // Formats are listed below the options
  command
      ->add_option("--format", request.format, "One of the formats below (default: by the output's ending)")
      ->type_name("NAME");

  // Parts that only stores have
  command
      ->add_option("--keyframes", state->keyframes,
                   "Write the cloud of every keyframe as DIR/<number>.ply, from map.db")
      ->type_name("DIR");
  command
      ->add_option("--robot", request.robot,
                   "Robot whose map to use, for an interrupted run of several robots")
      ->type_name("NAME");

  // Pictures come from the recordings
  command
      ->add_option("--recording", request.recordings,
                   "Recordings for the pictures, one per robot (default: those the map was made from)")
      ->type_name("INPUT")
      ->allow_extra_args(false);

  // Part of the map
  CLI::Option* what = command->add_option("--what", state->what, "Part of the map to write (default: cloud)")
                          ->check(CLI::IsMember({"cloud", "trajectory", "keyframes", "lines"}));
  CLI::Option* trajectory =
      command->add_flag("--trajectory", state->trajectory, "The same as --what trajectory")->excludes(what);
  command->add_flag("--lines", state->lines, "The same as --what lines")
      ->excludes(what)
      ->excludes(trajectory);
  command->add_flag("--mesh", state->mesh, "Write the cloud as a mesh, .ply, .obj or .glb")->excludes(what);

  // Outputs, options and the table of formats
  command->add_flag("--force", request.replace, "Replace the folder of an earlier export");
  command->add_flag("--describe", state->page, "Print a page about all formats (docs/guide/exports.md)");
  add_progress_option(*command, session);
  state->flags.add(*command, request.options);
  command->footer(formats_help());
}

}  // namespace plumbline::cli
