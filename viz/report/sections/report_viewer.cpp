// SPDX-License-Identifier: BSD-3-Clause
// The map to turn and walk through.
#include "plumbline/exports/view.hpp"
#include "plumbline/viewer/page.hpp"
#include "report_sections.hpp"

namespace plumbline::report {
namespace {

/// The plan at the page's width, and its tables.
std::string plan_html(const exports::PlanPage& plan) {
  if (plan.svg.empty()) return {};
  std::string out =
      "<figure class=\"plan\"><img alt=\"Floor plan\" src=\"data:image/svg+xml;base64," + base64(plan.svg) +
      "\"/><figcaption>Lengths in metres. Hatched: both faces of the wall were seen; dashed grey: the other "
      "face was not; dashed blue: assumed, or the limit of what was seen.</figcaption></figure>\n";
  for (const exports::PlanPage::Table& table : plan.tables) {
    std::string columns;
    for (const std::string& column : table.columns)
      columns += (columns.empty() ? "" : column == "Kind" ? "|" : "|>") + column;
    HtmlTable html(columns);
    for (const auto& row : table.rows) html.row(row);
    out += "<div class=\"half\"><h3>" + viz::markup_text(table.title) + "</h3>\n" + html.html() + "</div>\n";
  }
  return out;
}

}  // namespace

core::Result<std::string> viewer_html(ReportData& data, const ReportRequest& request,
                                      const core::Executor& executor, core::Log& log) {
  if (!data.extent) return std::string();

  exports::ExportRequest wanted;
  wanted.input = data.folder;
  wanted.options.points = static_cast<int>(request.points);

  // One map, or two to compare.
  exports::ExportRequest other = wanted;
  other.input = request.other;
  const auto silent = [](std::size_t, std::size_t) {};
  auto view = request.other.empty() ? exports::view_of(wanted, executor, log, silent)
                                    : exports::view_of_two(wanted, other, executor, log, silent);

  // Only a requested comparison must succeed.
  if (!view && !request.other.empty()) return tl::unexpected<core::Error>(view.error());
  if (!view) {
    data.missing.push_back("the map to walk through is left out: " + view.error().message);
    return std::string();
  }

  // Names as in the report.
  data.plan_html = plan_html(view->plan);
  view->scene.name = data.name;
  view->scene.clouds.front().name = data.name;

  // The viewer, with notes for its use.
  const std::string placing =
      view->scene.placing.empty() ? std::string() : paragraph(view->scene.placing + ".");
  return placing +
         viewer::fragment(
             view->scene,
             note("This browser has no WebGL 2 or runs no scripts; the pictures below show the map.")) +
         "<div class=\"screen\">" +
         note("Drag to turn, wheel to come nearer (after a click into the picture), ? for all keys.") +
         "</div>\n";
}

}  // namespace plumbline::report
