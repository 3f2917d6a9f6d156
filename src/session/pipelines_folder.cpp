// SPDX-License-Identifier: BSD-3-Clause
#include <dlfcn.h>
#include <fmt/format.h>

#include <system_error>

#include "plumbline/sensor/camera_file.hpp"
#include "plumbline/session/map.hpp"

namespace plumbline {
namespace {

namespace fs = std::filesystem;

/// The file of the library or module that holds this code, or of the program.
fs::path own_file() {
  std::error_code ec;
  Dl_info info{};
  if (dladdr(reinterpret_cast<const void*>(&own_file), &info) != 0) {
    const fs::path named = info.dli_fname;
    if (named.filename().string().find(".so") != std::string::npos) return fs::canonical(named, ec);
  }
  return fs::read_symlink("/proc/self/exe", ec);
}

}  // namespace

core::Result<fs::path> find_pipelines(const fs::path& chosen) {
  std::error_code ec;
  if (!chosen.empty()) {
    if (fs::is_directory(chosen, ec)) return chosen;
    return core::usage_error(fmt::format("pipelines folder: {}: no such folder", chosen.string()));
  }

  // Folders above the build folder have none of this build's.
  const fs::path own = own_file();
  for (fs::path at = own.parent_path(); at.has_relative_path() && at != PLUMBLINE_BUILD;
       at = at.parent_path()) {
    if (fs::path found = at / "share" / "plumbline" / "pipelines"; fs::is_directory(found, ec)) return found;
  }

  if (fs::is_directory(PLUMBLINE_SOURCE_PIPELINES, ec)) return fs::path(PLUMBLINE_SOURCE_PIPELINES);
  return core::usage_error(fmt::format(
      "{}: the shipped pipelines are not in share/plumbline/pipelines of a folder above; name their folder",
      own.string()));
}

core::Result<sensor::Camera> find_camera(const std::string& name_or_file, const fs::path& pipelines_folder) {
  const auto folder = find_pipelines(pipelines_folder);
  if (!folder) return tl::unexpected(folder.error());
  auto reading = sensor::find_camera(name_or_file, *folder / "cameras");
  if (!reading) return tl::unexpected(reading.error());

  // Calibrations of other programs may lack the image size
  if (reading->has_size) return std::move(reading->camera);
  return core::usage_error(name_or_file +
                           ": the file does not tell the size of the images; write a camera.yaml");
}

}  // namespace plumbline
