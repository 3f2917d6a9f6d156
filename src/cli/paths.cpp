// SPDX-License-Identifier: BSD-3-Clause
#include "paths.hpp"

#include <fmt/format.h>

#include <system_error>

namespace plumbline::cli {

namespace fs = std::filesystem;

core::Result<fs::path> find_pipelines_folder(const std::string& chosen) {
  std::error_code ec;
  if (!chosen.empty()) {
    if (fs::is_directory(chosen, ec)) return fs::path(chosen);
    return core::usage_error(fmt::format("--pipelines-dir: {}: no such folder", chosen));
  }
  const fs::path program = fs::read_symlink("/proc/self/exe", ec);
  const fs::path installed = program.parent_path().parent_path() / "share" / "plumbline" / "pipelines";
  for (const fs::path& folder : {installed, fs::path(PLUMBLINE_SOURCE_PIPELINES)}) {
    if (fs::is_directory(folder, ec)) return folder;
  }
  return core::usage_error(fmt::format(
      "{}: the shipped pipelines are not there; name their folder with --pipelines-dir", installed.string()));
}

std::string display_name(const fs::path& path) {
  const fs::path normal = fs::absolute(path).lexically_normal();
  return (normal.has_filename() ? normal : normal.parent_path()).filename().string();
}

fs::path file_in(const fs::path& path, const char* name) {
  std::error_code ec;
  return fs::is_directory(path, ec) ? path / name : path;
}

}  // namespace plumbline::cli
