// SPDX-License-Identifier: BSD-3-Clause
// plumbline compare BEFORE AFTER -o DIFF
#include <memory>

#include "app.hpp"
#include "option_flags.hpp"
#include "plumbline/changes/compare.hpp"
#include "recording_opener.hpp"
#include "terminal/print.hpp"

namespace plumbline::cli {
namespace {

struct CompareCommand {
  changes::CompareRequest request;
  OptionFlags flags;
};

/// Compares and prints what has changed.
core::Result<void> run_compare(CompareCommand& command, Session& session) {
  if (auto applied = command.flags.apply(); !applied) return applied;
  command.request.open = recording_opener(session);
  Console& console = session.console();
  const auto summary =
      changes::compare_maps(command.request, session.executor(), console, console.counting("views"));
  console.end_progress();
  if (!summary) return tl::unexpected<core::Error>(summary.error());
  if (!session.quiet) print("{}written    {}\n", summary->text, command.request.output.string());
  return {};
}

}  // namespace

void add_compare(CLI::App& app, Session& session) {
  // The two maps and the output
  const auto state = std::make_shared<CompareCommand>();
  CLI::App* command =
      add_command(app, session, "compare", "Tell what has changed between two maps of a place",
                  [&session, state] { return run_compare(*state, session); });

  // Earlier map, later map and output
  changes::CompareRequest& request = state->request;
  command->add_option("BEFORE", request.before, "Earlier map: a result folder, map.db, or a cloud file")
      ->required();
  command->add_option("AFTER", request.after, "Later map")->required();
  command->add_option("-o,--output", request.output, "Folder for the comparison")
      ->required()
      ->type_name("DIFF");

  // Stamps may be wrong
  const std::map<std::string, changes::Order> orders = {{"stamps", changes::Order::kStamps},
                                                        {"given", changes::Order::kGiven}};
  command
      ->add_option(
          "--order", request.order,
          "Which map is the later one: as their stamps say if both have the time of day, or as given "
          "(default: stamps)")
      ->type_name("stamps|given")
      ->transform(one_of(orders));

  // Points, progress and thresholds
  command
      ->add_option("--points", request.points,
                   "Largest number of points of each map, thinned by voxels; 0: all (default: 1500000)")
      ->type_name("N");
  command->add_flag("--force", request.replace, "Replace an earlier comparison");
  add_progress_option(*command, session);
  state->flags.add(*command, request.options);
}

}  // namespace plumbline::cli
