// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Files that no command may write over.
#include <filesystem>
#include <vector>

#include "plumbline/core/error.hpp"

namespace plumbline::maps {

/// True if `file` exists and `map`, `fuse` or `hub` wrote it as a part of a result. Files of other names that
/// users keep in a result's folder are not parts of it.
bool is_part_of_result(const std::filesystem::path& file);

/// Errors (kUsage): `output` is one of the `inputs`, or a part of a result or of a recording.
core::Result<void> check_output(const std::filesystem::path& output,
                                const std::vector<std::filesystem::path>& inputs);

}  // namespace plumbline::maps
