// SPDX-License-Identifier: BSD-3-Clause
// plumbline convert RECORDING OUT
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <string>
#include <system_error>

#include "app.hpp"
#include "plumbline/dataset/convert.hpp"
#include "plumbline/pipeline/input.hpp"
#include "terminal/print.hpp"
#include "terminal/signals.hpp"

namespace plumbline::cli {
namespace {

struct ConvertRequest {
  std::string input;
  std::filesystem::path output;
  dataset::OpenOptions open;
  bool replace = false;
};

/// True if `inner` is `outer` or lies in it; links are followed.
bool lies_in(const std::filesystem::path& inner, const std::filesystem::path& outer) {
  const auto ends = std::mismatch(outer.begin(), outer.end(), inner.begin(), inner.end());
  return ends.first == outer.end();
}

/// Refuses a copy that would replace what it is made from.
core::Result<void> check_places(const std::filesystem::path& input, const std::filesystem::path& output) {
  std::error_code ec;
  if (!std::filesystem::exists(input, ec)) return {};
  const auto resolved = [&ec](const std::filesystem::path& path) {
    const auto real = std::filesystem::weakly_canonical(path, ec);
    return real.has_filename() ? real : real.parent_path();
  };
  const std::filesystem::path from = resolved(input);
  const std::filesystem::path to = resolved(output);
  if (!lies_in(from, to) && !lies_in(to, from) && !std::filesystem::equivalent(from, to, ec)) return {};
  return core::usage_error(
      fmt::format("{}: is the recording that is read, or lies in it, or contains it; "
                  "choose another place",
                  output.string()));
}

core::Result<void> convert(Session& session, ConvertRequest& request) {
  // A copy never overwrites its source
  if (auto apart = check_places(request.input, request.output); !apart) return apart;
  const auto pipelines = session.pipelines_folder();
  if (!pipelines) return tl::unexpected<core::Error>(pipelines.error());
  request.open.cameras_folder = *pipelines / "cameras";
  Console& console = session.console();
  const auto source =
      pipeline::open_input(request.input, request.open, *pipelines / "scenes", session.executor(), console);
  if (!source) return tl::unexpected<core::Error>(source.error());

  // Ctrl-C ends the copy after a frame
  const core::StopToken stop = stop_on_signals();
  const auto show_progress = console.counting("frames");
  dataset::ConvertOptions options;
  options.replace = request.replace;
  options.stop = [&stop] { return stop.stop_requested(); };
  options.progress = [&](std::size_t frames) { show_progress(frames, (*source)->size()); };

  // Frames that cannot be read are left out
  const auto summary = dataset::convert_recording(**source, request.output, options, console);
  console.end_progress();
  if (!summary) return tl::unexpected<core::Error>(summary.error());

  // The user learns what is missing
  if (summary->stopped) console.warning("stopped: the copy ends here");
  if (summary->unreadable > 0)
    console.warning(fmt::format("{} of {} frames cannot be copied and are left out", summary->unreadable,
                                summary->written + summary->unreadable));
  if (!session.quiet) print("written    {} frames to {}\n", summary->written, request.output.string());
  return {};
}

}  // namespace

/// Options of convert.
void add_convert(CLI::App& app, Session& session) {
  const auto request = std::make_shared<ConvertRequest>();
  CLI::App* command =
      add_command(app, session, "convert", "Write a recording as a TUM folder or an MCAP file",
                  [&session, request] { return convert(session, *request); });
  command->add_option("INPUT", request->input, "A recording: a folder or a ROS bag")->required();
  command->add_option("OUT", request->output, "The new folder; an MCAP file if it ends in .mcap")->required();
  command->add_option("--camera", request->open.camera, "Shipped calibration or file")
      ->type_name("NAME|FILE");
  command->add_option("--format", request->open.format, "Layout of INPUT (default: auto)")
      ->check(CLI::IsMember(dataset::layout_names()));
  add_topic_option(*command, request->open);
  add_time_range(*command, request->open);
  command->add_option("--every", request->open.every, "Use every N-th frame")
      ->type_name("N")
      ->check(CLI::Range(1, 100000));
  command->add_flag("--force", request->replace, "Replace an earlier copy");
  add_progress_option(*command, session);
}

}  // namespace plumbline::cli
