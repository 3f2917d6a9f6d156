// SPDX-License-Identifier: BSD-3-Clause
// PCD 0.7: PCL's own.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include "clouds/columns_text.hpp"
#include "formats.hpp"

namespace plumbline::exports {
namespace {

/// Writes PCD as text, in which a colour is one number.
core::Result<void> write_ascii_pcd(const std::filesystem::path& output, const cloud::CloudFile& file,
                                   const std::vector<std::string>& comments) {
  core::OutputFile out(output);
  const std::size_t points = file.cloud->size();
  out.write("# .PCD v0.7 - Point Cloud Data file format\n");
  for (const std::string& comment : comments) out.write("# " + comment + "\n");

  // Large coordinates need doubles
  out.write(
      fmt::format("VERSION 0.7\n"
                  "FIELDS x y z rgb normal_x normal_y normal_z\nSIZE {}\nTYPE F F F U F F F\n"
                  "COUNT 1 1 1 1 1 1 1\nWIDTH {}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {}\n"
                  "DATA ascii\n",
                  file.shift.isZero(0.0) ? "4 4 4 4 4 4 4" : "8 8 8 4 4 4 4", points, points));

  // The three channels make one number
  for (const cloud::Point& p : *file.cloud) {
    const unsigned color = (unsigned{p.r} << 16U) | (unsigned{p.g} << 8U) | unsigned{p.b};
    const Eigen::Vector3d at = p.getVector3fMap().cast<double>() + file.shift;
    out.write(fmt::format("{:.5f} {:.5f} {:.5f} {} {:.4f} {:.4f} {:.4f}\n", at.x(), at.y(), at.z(), color,
                          p.normal_x, p.normal_y, p.normal_z));
  }
  return out.commit();
}

/// Writes PCD, binary unless text is wanted.
core::Result<ExportSummary> write_pcd_cloud(MapSource& source, const std::filesystem::path& output) {
  const auto cloud = source.cloud();
  if (!cloud) return tl::unexpected(cloud.error());
  const cloud::CloudFile& file = **cloud;
  const std::vector<std::string> comments = source.frame().comments();
  auto written = source.options().ascii
                     ? write_ascii_pcd(output, file, comments)
                     : cloud::write_pcd(output, *file.cloud, file.columns, file.shift, comments);
  if (!written) return tl::unexpected(written.error());
  ExportSummary summary;
  summary.written = {output};
  note_colorless(file, summary);
  return summary;
}

}  // namespace

Format pcd_format() {
  return {
      "pcd",
      {".pcd"},
      {Content::kCloud},
      "",
      "Cloud as PCD",
      "For PCL; binary, with the same columns as PLY. `--ascii on` writes text: positions, colours, normals.",
      {"voxel", "ascii"},
      &write_pcd_cloud};
}

}  // namespace plumbline::exports
