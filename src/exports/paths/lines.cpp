// SPDX-License-Identifier: BSD-3-Clause
// 3D line landmarks as edges.
#include "paths/lines.hpp"

#include "formats.hpp"

namespace plumbline::exports {

/// Lines of the result's file, else of the store, in the frame of exports.
core::Result<std::vector<maps::LineSegment3>> lines_of(const MapSource& source) {
  std::error_code ec;
  const auto& result = source.place().result;
  if (result && std::filesystem::exists(result->lines(), ec)) return maps::read_lines_ply(result->lines());
  const auto store = source.store("the map's lines");
  if (!store) return tl::unexpected(store.error());
  std::vector<maps::LineSegment3> lines = maps::line_segments((*store)->stored().map);
  for (auto& [start, end] : lines) {
    start = source.world_from_map() * start;
    end = source.world_from_map() * end;
  }
  return lines;
}

namespace {

/// Writes lines that are wholly in the selected part.
core::Result<ExportSummary> write_lines(MapSource& source, const std::filesystem::path& output) {
  auto lines = lines_of(source);
  if (!lines) return tl::unexpected(lines.error());
  std::vector<maps::LineSegment3> chosen;
  for (const auto& [start, end] : *lines) {
    if (source.selects(start) && source.selects(end)) chosen.emplace_back(start, end);
  }
  if (auto written = maps::write_lines_ply(output, chosen, {}, source.frame().comments()); !written)
    return tl::unexpected(written.error());
  ExportSummary summary;
  summary.written = {output};
  return summary;
}

}  // namespace

Format lines_format() {
  return {"lines",
          {".ply"},
          {Content::kLines},
          "",
          "3D line landmarks",
          "`--what lines`: vertices and edges, as MeshLab, CloudCompare and Open3D read them.",
          {},
          &write_lines};
}

}  // namespace plumbline::exports
