// SPDX-License-Identifier: BSD-3-Clause
#include "paths.hpp"

#include <system_error>

namespace plumbline::cli {

namespace fs = std::filesystem;

std::string display_name(const fs::path& path) {
  const fs::path normal = fs::absolute(path).lexically_normal();
  return (normal.has_filename() ? normal : normal.parent_path()).filename().string();
}

fs::path file_in(const fs::path& path, const char* name) {
  std::error_code ec;
  return fs::is_directory(path, ec) ? path / name : path;
}

}  // namespace plumbline::cli
