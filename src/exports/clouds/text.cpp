// SPDX-License-Identifier: BSD-3-Clause
// CSV and XYZ: for tables, scripts and programs that know nothing else.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "clouds/columns_text.hpp"
#include "formats.hpp"
#include "plumbline/core/csv.hpp"

namespace plumbline::exports {
namespace {

/// Rows of numbers; CSV begins with the names of its columns.
core::Result<ExportSummary> write_text_cloud(MapSource& source, const std::filesystem::path& output,
                                             bool csv) {
  const auto cloud = source.cloud();
  if (!cloud) return tl::unexpected(cloud.error());
  core::OutputFile out(output);
  if (csv) {
    std::vector<std::string> names = text_columns(**cloud);
    std::transform(names.begin(), names.end(), names.begin(), &core::csv_field);
    out.write(fmt::format("{}\n", fmt::join(names, ",")));
  }
  put_text_rows(out, **cloud, csv ? ',' : ' ');
  if (auto written = out.commit(); !written) return tl::unexpected(written.error());
  ExportSummary summary;
  summary.written = {output};
  note_colorless(**cloud, summary);
  return summary;
}

core::Result<ExportSummary> write_csv_cloud(MapSource& source, const std::filesystem::path& output) {
  return write_text_cloud(source, output, true);
}

core::Result<ExportSummary> write_xyz_cloud(MapSource& source, const std::filesystem::path& output) {
  return write_text_cloud(source, output, false);
}

}  // namespace

Format csv_format() {
  return {"csv",
          {".csv"},
          {Content::kCloud},
          "",
          "Cloud as a table",
          "A header line names the columns: x, y, z, red, green, blue, the normal, and the other columns of "
          "the map.",
          {"voxel"},
          &write_csv_cloud};
}

Format xyz_format() {
  return {"xyz",
          {".xyz", ".asc"},
          {Content::kCloud},
          "",
          "Cloud as rows of numbers",
          "The columns of `csv`, separated by blanks, without a header: CloudCompare asks for their meaning.",
          {"voxel"},
          &write_xyz_cloud};
}

}  // namespace plumbline::exports
