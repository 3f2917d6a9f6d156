// SPDX-License-Identifier: BSD-3-Clause
#include "source/export_folder.hpp"

#include <system_error>

namespace plumbline::exports {
namespace {

bool is_export(const std::filesystem::path& folder) {
  std::error_code ec;
  return std::filesystem::is_regular_file(folder / kExportNote, ec);
}

}  // namespace

core::Result<maps::OutputFolder> prepare_export(const std::filesystem::path& folder, bool replace) {
  static const maps::FolderKind kind{
      is_export,
      {kExportNote, "transforms.json", "points.ply", "images/*.png", "depth/*.png", "sparse/0/cameras.*",
       "sparse/0/images.*", "sparse/0/points3D.*"}};
  return maps::OutputFolder::prepare(folder, replace, false, kind);
}

}  // namespace plumbline::exports
