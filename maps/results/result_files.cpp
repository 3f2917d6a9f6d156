// SPDX-License-Identifier: BSD-3-Clause
// The files of a result: docs/reference/files.md describes them.
#include <system_error>

#include "plumbline/maps/output_folder.hpp"

namespace plumbline::maps {
namespace {

core::FileNames result_files() {
  // Files of the whole run
  core::FileNames files{"map.ply",
                        "map.pcd",
                        "lines.ply",
                        "levels/map_*mm.ply",
                        "snapshots/*.png",
                        "keyframes/*.ply",
                        "trajectory.txt",
                        "keyframes.txt",
                        "keyframes.csv",
                        "pose_samples.npy",
                        "frames.csv",
                        "timing.csv",
                        "summary.json",
                        "config.yaml",
                        "camera.yaml",
                        "adjust.json",
                        "georeference.json",
                        "tags.csv",
                        "edits.yaml",
                        "rig.yaml",
                        "hub.log",
                        "report.html",
                        "evaluation.json",
                        "evaluation_cloud.json",
                        "meetings/*/meeting.json",
                        "meetings/*/*.txt",
                        "meetings/*/map.png"};

  // For each robot or each component
  for (const char* folder : {"robots/*/", "components/*/"}) {
    for (const char* file : {"map.ply", "lines.ply", "trajectory.txt", "keyframes.txt", "camera.yaml"})
      files.push_back(std::string(folder) + file);
  }

  // SQLite keeps a journal or log and its index beside each.
  for (const char* store : {"map.db", "network.db", "robots/*/map.db", ".clouds-*.db"}) {
    files.emplace_back(store);
    files.push_back(std::string(store) + "-*");
  }
  return files;
}

/// A hub first fuses into a folder of its own, "fused".
core::FileNames with_fused(const core::FileNames& files) {
  core::FileNames all = files;
  for (const std::string& file : files) all.push_back("fused*/" + file);
  all.emplace_back("fused*/.plumbline-*");
  return all;
}

}  // namespace

bool is_result_folder(const std::filesystem::path& folder) {
  std::error_code ec;
  return std::filesystem::is_regular_file(folder / "summary.json", ec) &&
         std::filesystem::is_regular_file(folder / "config.yaml", ec);
}

const FolderKind& result_kind() {
  static const FolderKind kind{is_result_folder, with_fused(result_files())};
  return kind;
}

}  // namespace plumbline::maps
