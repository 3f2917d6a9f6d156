// SPDX-License-Identifier: BSD-3-Clause
// plumbline report OUT
#include <fmt/format.h>

#include <memory>

#include "app.hpp"
#include "plumbline/report/report.hpp"
#include "terminal/print.hpp"

namespace plumbline::cli {
namespace {

/// Writes the report and says what was missing.
int report(Session& session, const report::ReportRequest& request) {
  const auto done = report::write_report(request, session.executor(), session.console());
  if (!done) return session.fail(done.error());
  for (const std::string& line : done->missing) session.console().warning(line);
  if (!session.quiet) {
    print("written    {} ({:.1f} MB)\n", done->file.string(), static_cast<double>(done->bytes) / 1e6);
  }
  return 0;
}

}  // namespace

void add_report(CLI::App& app, Session& session) {
  // The result and another to compare
  const auto request = std::make_shared<report::ReportRequest>();
  CLI::App* command = add_command(app, session, "report", "Write an HTML report of a result: OUT/report.html",
                                  [&session, request] { return report(session, *request); });
  command->add_option("OUT", request->result, "Result folder of plumbline map or fuse")->required();
  command->add_option("OTHER", request->other,
                      "A second result, shown together with the first in the map to walk through");

  // Output and truth
  command->add_option("-o,--output", request->output, "File to write (default: OUT/report.html)")
      ->type_name("FILE.html");
  command
      ->add_option("--truth", request->truth,
                   "Compare the paths with the true ones: a recording with groundtruth.txt, a folder with "
                   "one for each robot, or a file in TUM format")
      ->type_name("FOLDER|FILE");

  // Size of the map to walk through
  command
      ->add_option(
          "--points", request->points,
          "Largest number of points of the map to walk through, thinned by voxels; 0: all (default: 1500000)")
      ->type_name("N");

  // The first page
  command->add_option("--title", request->title, "Title (default: the folder's name)")->type_name("TEXT");
  command->add_option("--client", request->client, "Client, for the first page")->type_name("TEXT");
  command->add_option("--address", request->address, "Address, for the first page")->type_name("TEXT");
  command->add_option("--date", request->date, "Date of the recording, for the first page")
      ->type_name("TEXT");
  command->add_option("--logo", request->logo, "Logo for the first page: PNG, JPEG or SVG")
      ->type_name("FILE");
  command->add_flag("--force", request->replace, "Replace an earlier report");
}

}  // namespace plumbline::cli
