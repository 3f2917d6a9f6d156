// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Folders from which only files that the program wrote are ever removed.
#include <filesystem>
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"

namespace plumbline::core {

/// Paths within a folder, with '/' between names: '*' stands for any text within one name, "**" at the end
/// for everything below.
using FileNames = std::vector<std::string>;

/// True if `path`, relative to the folder, is one of `names`, or what OutputFile first writes for one.
bool is_own_file(const std::string& path, const FileNames& names);

/// Relative paths of all that is in `folder`, sorted, but of folders only if they are empty; these end with
/// '/'. Links are not followed.
std::vector<std::string> files_below(const std::filesystem::path& folder);

/// The part of files_below() that is not in `names`: somebody else put it there.
std::vector<std::string> foreign_files(const std::filesystem::path& folder, const FileNames& names);

/// A few of them for a message: "notes.txt, photos/1.jpg and 7 more".
std::string list_of_files(const std::vector<std::string>& files);

/// Removes the files of `folder` that are in `names`, then the folders that are empty without them, and
/// `folder` itself if it is. All else stays. Error (kOutput): a file cannot be removed.
Result<void> remove_own_files(const std::filesystem::path& folder, const FileNames& names);

}  // namespace plumbline::core
