// SPDX-License-Identifier: BSD-3-Clause
// The map to turn and walk through.
#include "plumbline/exports/view.hpp"
#include "plumbline/viewer/page.hpp"
#include "report_sections.hpp"

namespace plumbline::report {

core::Result<std::string> viewer_html(ReportData& data, const ReportRequest& request,
                                      const core::Executor& executor, core::Log& log) {
  if (!data.extent) return std::string();

  exports::ExportRequest wanted;
  wanted.input = data.folder;
  wanted.options.points = static_cast<int>(request.points);

  exports::ExportRequest other = wanted;
  other.input = request.other;
  const auto silent = [](std::size_t, std::size_t) {};
  auto view = request.other.empty() ? exports::view_of(wanted, executor, log, silent)
                                    : exports::view_of_two(wanted, other, executor, log, silent);

  if (!view && !request.other.empty()) return tl::unexpected<core::Error>(view.error());
  if (!view) {
    data.missing.push_back("the map to walk through is left out: " + view.error().message);
    return std::string();
  }

  view->scene.name = data.name;
  view->scene.clouds.front().name = data.name;
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
