// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Files that Git LFS has not fetched: a few lines of text stand in their place.
#include <filesystem>
#include <string_view>

namespace plumbline::core {

/// Problem and remedy of a pointer in the place of a file, for messages behind the file's name.
inline constexpr const char* kLfsPointer =
    "is a Git LFS pointer, not the file itself; run `git lfs pull` in its repository";

/// True if a file that begins with these bytes is a Git LFS pointer.
bool begins_as_lfs_pointer(std::string_view beginning);

/// The same of a file; false if it cannot be read.
bool is_lfs_pointer(const std::filesystem::path& file);

}  // namespace plumbline::core
