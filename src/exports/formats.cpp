// SPDX-License-Identifier: BSD-3-Clause
#include "formats.hpp"

namespace plumbline::exports {

void note_colorless(const cloud::CloudFile& file, ExportSummary& summary) {
  if (!file.has_color) summary.notes.emplace_back("the cloud has no colour: all points are white");
}

const std::vector<Format>& formats() {
  static const std::vector<Format> kTable{
      colmap_format(), nerfstudio_format(), grid_format(),  las_format(),   glb_format(),
      poses_format(),  tum_format(),        kitti_format(), euroc_format(), path_format(),
      plan_format(),   octomap_format(),    ply_format(),   pcd_format(),   csv_format(),
      xyz_format(),    mesh_format(),       lines_format(), html_format(),
  };
  return kTable;
}

const std::vector<std::string>& common_options() {
  static const std::vector<std::string> kCommon{"box", "z", "storey"};
  return kCommon;
}

}  // namespace plumbline::exports
