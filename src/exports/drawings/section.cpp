// SPDX-License-Identifier: BSD-3-Clause
// A vertical section: the cells, 2 cm wide, that contain points of the cloud near the cut.
#include <fmt/format.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <cmath>
#include <set>

#include "drawings/plan_sheets.hpp"

namespace plumbline::exports {
namespace {

constexpr double kSectionCell_m = 0.02;
using SectionCells = std::set<std::pair<long, long>>;  // by row, then column

/// Cells of the section that hold points of a thin slab around the cut.
SectionCells cells_near(const cloud::CloudFile& file, const Eigen::Vector2d& from,
                        const Eigen::Vector2d& to) {
  constexpr double kHalfThick_m = 0.03;
  const Eigen::Vector2d along = (to - from).normalized();
  const Eigen::Vector2d across(-along.y(), along.x());
  SectionCells cells;
  for (const cloud::Point& p : *file.cloud) {
    const Eigen::Vector3d at = p.getVector3fMap().cast<double>() + file.shift;
    const Eigen::Vector2d way = at.head<2>() - from;
    const double s = along.dot(way);
    if (s < 0.0 || s > (to - from).norm() || std::abs(across.dot(way)) > kHalfThick_m) continue;
    cells.emplace(std::lround(std::floor(at.z() / kSectionCell_m)),
                  std::lround(std::floor(s / kSectionCell_m)));
  }
  return cells;
}

/// Neighbours in a row as one rectangle.
void draw_cells(const SectionCells& cells, std::size_t layer, Drawing& drawing) {
  for (auto cell = cells.begin(); cell != cells.end();) {
    auto last = cell;
    auto next = std::next(cell);
    while (next != cells.end() && next->first == last->first && next->second == last->second + 1)
      last = next++;

    const double z0 = static_cast<double>(cell->first) * kSectionCell_m;
    const double s0 = static_cast<double>(cell->second) * kSectionCell_m;
    const double s1 = static_cast<double>(last->second + 1) * kSectionCell_m;
    drawing.lines.push_back(
        {layer, {{s0, z0}, {s1, z0}, {s1, z0 + kSectionCell_m}, {s0, z0 + kSectionCell_m}}, true, true});
    cell = next;
  }
}

}  // namespace

/// The sheet of a vertical section.
core::Result<Drawing> section_sheet(MapSource& source, ExportSummary& summary) {
  const std::vector<double>& line = source.options().section;
  if (line.size() != 4) return core::usage_error("--section: takes two places seen from above, x,y,x,y");
  const Eigen::Vector2d from(line[0], line[1]);
  const Eigen::Vector2d to(line[2], line[3]);
  if ((to - from).norm() < kSectionCell_m) return core::usage_error("--section: its two places are one");

  // Points near the cut
  const auto cloud = source.cloud();
  if (!cloud) return tl::unexpected(cloud.error());
  const SectionCells cells = cells_near(**cloud, from, to);
  if (cells.empty()) {
    return core::input_error(
        fmt::format("{}: the section meets no point of the cloud", source.request().output.string()));
  }

  // The title block tells both ends of the section
  SheetFacts facts;
  const std::string what =
      fmt::format("section from {:g},{:g} to {:g},{:g}", line[0], line[1], line[2], line[3]);
  if (auto told =
          add_facts(source, {{"Section", what}, {"Coordinates", "x along the section, y up; metres"}}, facts);
      !told)
    return tl::unexpected(told.error());
  summary.notes.push_back(fmt::format("a section {:.2f} m long", (to - from).norm()));

  // A section has no walls, so the sheet has no tables
  return sheet_of(source.options(), facts, {}, 1.0,
                  [&](const PlanStyle&, const PlanLayers& layers, Drawing& drawing) {
                    draw_cells(cells, layers.wall, drawing);
                    drawing.title = source.name() + ": " + what;
                    drawing.notes.emplace_back("x along the section, y up; metres");
                  });
}

}  // namespace plumbline::exports
