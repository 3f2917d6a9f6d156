// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

#include "plumbline/core/error.hpp"

namespace plumbline::cli {

/// The shipped pipelines, cameras, filters and scenes: `chosen` if given, else share/plumbline/pipelines
/// beside the program's bin/, else those of the source tree it was built from.
core::Result<std::filesystem::path> find_pipelines_folder(const std::string& chosen);

/// The name of a folder or file for titles: "out/kitchen/" gives "kitchen".
std::string display_name(const std::filesystem::path& path);

/// The file itself, or `name` in it when it is a folder.
std::filesystem::path file_in(const std::filesystem::path& path, const char* name);

}  // namespace plumbline::cli
