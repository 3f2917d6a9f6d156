// SPDX-License-Identifier: BSD-3-Clause
// A floor plan, or a vertical section: SVG, PDF, DXF, JSON.
#include <fmt/format.h>

#include <algorithm>

#include "drawings/plan_sheets.hpp"
#include "formats.hpp"
#include "plumbline/core/output_file.hpp"
#include "plumbline/core/text.hpp"

namespace plumbline::exports {
namespace {

/// Writes the plan as numbers.
core::Result<ExportSummary> write_plan_json(MapSource& source, const std::filesystem::path& output) {
  if (!source.options().section.empty())
    return core::usage_error("--section: is a drawing; write .svg, .pdf or .dxf");
  const auto plan = plan_of(source);
  if (!plan) return tl::unexpected(plan.error());
  ExportSummary summary;
  summary.notes = notes_of(*plan);
  summary.written = {output};
  const auto written = core::write_file(
      output, plan_json(*plan, source.frame_text(), source.floor_m(), source.options().cut_m));
  if (!written) return tl::unexpected(written.error());
  return summary;
}

/// Writes the pages, as one PDF, or as a file each; those of upper storeys get a number.
core::Result<void> write_pages(const std::vector<Drawing>& pages, const std::filesystem::path& output,
                               ExportSummary& summary) {
  const std::string ending = core::ending_of(output);
  if (ending == ".pdf") {
    summary.written = {output};
    return write_pdf(output, pages);
  }

  for (std::size_t i = 0; i < pages.size(); ++i) {
    std::filesystem::path file = output;
    if (i > 0)
      file.replace_filename(fmt::format("{}_{}{}", output.stem().string(), i, output.extension().string()));
    auto written = ending == ".svg" ? write_svg(file, pages[i]) : write_dxf(file, pages[i]);
    if (!written) return written;
    summary.written.push_back(file);
  }
  return {};
}

/// Writes a plan or a section; only plans that are drawn can be in world coordinates.
core::Result<ExportSummary> write_plan(MapSource& source, const std::filesystem::path& output) {
  const auto world = georeference_of(source.options(), source.log());
  if (!world) return tl::unexpected(world.error());
  const bool section = !source.options().section.empty(), json = core::ending_of(output) == ".json";
  if (*world && (json || section)) {
    return core::usage_error(
        fmt::format("{}: only plans as .svg, .pdf and .dxf are moved into world coordinates; leave --datum "
                    "and --epsg out",
                    output.string()));
  }

  // JSON has no sheets; a drawing has one for each storey
  if (json) return write_plan_json(source, output);
  ExportSummary summary;
  core::Result<std::vector<Drawing>> pages;
  if (section) {
    auto page = section_sheet(source, summary);
    if (!page) return tl::unexpected(page.error());
    pages = std::vector<Drawing>{std::move(*page)};
  } else {
    pages = plan_sheets(source, *world, summary);
  }

  // The georeference is a file next to the drawing
  if (!pages) return tl::unexpected(pages.error());
  auto written = write_pages(*pages, output, summary);
  if (written && *world) written = write_georeference(output, **world);
  if (!written) return tl::unexpected(written.error());

  // Scale and paper of the first page stand for all
  const DrawingSheet& sheet = pages->front().sheet;
  summary.notes.push_back(fmt::format("1:{} on {}{}", sheet.scale, sheet.paper,
                                      pages->size() > 1 ? fmt::format(", {} sheets", pages->size()) : ""));
  return summary;
}

}  // namespace

/// Counts of walls, doors and rooms, and what could not be known.
std::vector<std::string> notes_of(const plans::WallPlan& plan) {
  std::size_t gaps = 0;
  const auto doors = std::count_if(plan.doors.begin(), plan.doors.end(), [](const plans::WallDoor& d) {
    return d.kind != plans::OpeningKind::kWindow;
  });
  for (const plans::WallLine& wall : plan.walls) gaps += wall.gaps.size();
  const auto closed =
      std::count_if(plan.rooms.begin(), plan.rooms.end(), [](const plans::WallRoom& r) { return r.closed; });
  const auto open = static_cast<std::ptrdiff_t>(plan.rooms.size()) - closed;
  std::vector<std::string> notes{
      fmt::format("{} walls, {} doors{}, {} closed rooms{}", plan.walls.size(), doors,
                  gaps > 0 ? fmt::format(", {} windows or gaps at the cut", gaps) : "", closed,
                  open > 0 ? fmt::format(", {} seen in part", open) : "")};
  if (!plan.rays_known)
    notes.emplace_back(
        "without map.db it is not known what cameras saw through: only doors below a lintel are found");
  return notes;
}

Format plan_format() {
  return {"plan",
          {".svg", ".pdf", ".dxf", "plan.json"},
          {Content::kCloud},
          "",
          "Floor plan or section for architects",
          "A sheet with the walls at `--cut` over the floor, hatched where both faces were seen, else as "
          "thick as is assumed; openings with clear widths, furniture, dimensions, rooms with areas, tables, "
          "title block, scale bar and coordinates ([plans.md](plans.md)). SVG, PDF and DXF (R2000, metres, "
          "layers A-WALL, A-DOOR, A-GLAZ, A-AREA, A-FURN, A-ANNO) show the same; a storey is a page of the "
          "PDF, or a file. `plan.json` holds rooms, openings and walls as numbers. `--section x,y,x,y` draws "
          "a vertical cut along that line instead. Doors are where cameras looked through a wall (without "
          "`map.db`: what lies below a lintel); closed doors are wall ([plans.md](../method/plans.md)).",
          {"cut", "section", "paper", "scale", "title", "client", "address", "date", "title_block", "decimal",
           "without", "voxel", "datum", "epsg", "origin"},
          &write_plan};
}

}  // namespace plumbline::exports
