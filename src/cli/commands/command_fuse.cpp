// SPDX-License-Identifier: BSD-3-Clause
// plumbline fuse MAP MAP... -o OUT
#include <fmt/format.h>

#include <memory>

#include "app.hpp"
#include "plumbline/adjust/control.hpp"
#include "plumbline/pipeline/fuse_maps.hpp"
#include "terminal/signals.hpp"

namespace plumbline::cli {
namespace {

constexpr std::size_t kMaxMaps = 255;

/// "x,y,z=x,y,z" each. Errors (kUsage).
core::Result<void> read_picks(const std::vector<std::string>& words, pipeline::FuseRequest& request) {
  for (const std::string& word : words) {
    const std::size_t sign = word.find('=');
    const auto first = adjust::place_of(word.substr(0, sign), "--pick");
    const auto second =
        adjust::place_of(sign == std::string::npos ? std::string() : word.substr(sign + 1), "--pick");
    if (!first) return tl::unexpected(first.error());
    if (!second) return tl::unexpected(second.error());
    request.picks.emplace_back(*first, *second);
  }
  return {};
}

/// Fuses the maps and prints the summary.
int fuse(Session& session, pipeline::FuseRequest request, const std::vector<std::string>& picks) {
  if (auto read = read_picks(picks, request); !read) return session.fail(read.error());
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
  const auto picks = std::make_shared<std::vector<std::string>>();
  CLI::App* command =
      add_command(app, session, "fuse", "Merge finished maps of several robots into one frame",
                  [&session, request, picks] { return fuse(session, *request, *picks); });
  command
      ->add_option("MAP", request->maps,
                   "Result folders of plumbline map or fuse; their order does not matter")
      ->required()
      ->expected(2, CLI::detail::expected_max_vector_size);
  command->add_option("-o,--output", request->output, "Folder for the result")->required()->type_name("OUT");

  // The frame of the result, and joins that places alone do not make.
  command
      ->add_option("--anchor", request->anchor,
                   "Robot whose map defines the frame of the result (default: the one with the largest map)")
      ->type_name("NAME");
  command
      ->add_option(
          "--pick", *picks,
          "A place in the first of two maps and the same one in the second, for maps that share a door "
          "only; two or more")
      ->expected(1)
      ->take_all()
      ->type_name("X,Y,Z=X,Y,Z");
  add_rig_option(*command, request->rig);
  add_pipeline_options(*command, session, *request);
}

}  // namespace plumbline::cli
