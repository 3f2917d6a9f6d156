// SPDX-License-Identifier: BSD-3-Clause
// PLY (Turk 1994), which every program for point clouds reads.
#include <fmt/format.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include "clouds/columns_text.hpp"
#include "formats.hpp"
#include "source/georeference.hpp"

namespace plumbline::exports {
namespace {

/// Writes PLY as text, with the columns of text_columns().
core::Result<void> write_ascii_ply(const std::filesystem::path& output, const cloud::CloudFile& file,
                                   const std::vector<std::string>& comments) {
  core::OutputFile out(output);
  out.write("ply\nformat ascii 1.0\ncomment plumbline, metres\n");
  for (const std::string& comment : comments) out.write("comment " + comment + "\n");

  // Large coordinates need doubles
  out.write(fmt::format("element vertex {}\n", file.cloud->size()));
  for (const std::string& name : text_columns(file)) {
    const bool byte = name == "red" || name == "green" || name == "blue" || name == "robot";
    const char* type = byte ? "uchar" : name == "observations" ? "int" : "float";
    const bool position = name == "x" || name == "y" || name == "z";
    out.write(fmt::format("property {} {}\n", position && !file.shift.isZero(0.0) ? "double" : type, name));
  }
  out.write("end_header\n");

  put_text_rows(out, file, ' ');
  return out.commit();
}

/// Writes PLY, in world coordinates if the options give them.
core::Result<ExportSummary> write_ply_cloud(MapSource& source, const std::filesystem::path& output) {
  const auto reference = georeference_of(source.options(), source.log());
  if (!reference) return tl::unexpected(reference.error());
  const auto cloud = source.cloud();
  if (!cloud) return tl::unexpected(cloud.error());

  ExportSummary summary;
  summary.written = {output};
  std::vector<std::string> comments;

  // The header names the frame
  if (*reference) {
    comments = {fmt::format("frame: {} (EPSG:{}); x east, y north, z up, metres", (*reference)->name,
                            (*reference)->epsg)};
    summary.notes.push_back(fmt::format("in {} (EPSG:{})", (*reference)->name, (*reference)->epsg));
  } else {
    comments = source.frame().comments();
  }

  // Points in that frame
  const cloud::CloudFile file = *reference ? to_world(**cloud, **reference) : **cloud;
  auto written = source.options().ascii
                     ? write_ascii_ply(output, file, comments)
                     : cloud::write_ply(output, *file.cloud, file.columns, file.shift, comments);
  note_colorless(file, summary);
  if (written && *reference) written = write_georeference(output, **reference);
  if (!written) return tl::unexpected(written.error());

  return summary;
}

}  // namespace

Format ply_format() {
  return {
      "ply",
      {".ply"},
      {Content::kCloud},
      "",
      "Cloud as PLY",
      "Position, normal, colour, and the other columns of the map (`confidence`, `observations`, `robot`, "
      "`sigma`); opens in CloudCompare, MeshLab, PCL, Open3D. With `--datum` or `--epsg` positions are "
      "doubles in world coordinates, as the header says; the whole transform is in `FILE.georeference.json`.",
      {"voxel", "ascii", "datum", "epsg", "origin"},
      &write_ply_cloud};
}

}  // namespace plumbline::exports
