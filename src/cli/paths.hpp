// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

namespace plumbline::cli {

/// The name of a folder or file for titles: "out/kitchen/" gives "kitchen".
std::string display_name(const std::filesystem::path& path);

/// The file itself, or `name` in it when it is a folder.
std::filesystem::path file_in(const std::filesystem::path& path, const char* name);

}  // namespace plumbline::cli
