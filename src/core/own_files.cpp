// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/core/own_files.hpp"

#include <algorithm>
#include <cctype>
#include <set>
#include <string_view>
#include <system_error>

namespace plumbline::core {
namespace {

namespace fs = std::filesystem;

/// True if a path matches; `*` stands for anything within a folder, `**` at the end for everything below.
bool matches(std::string_view pattern, std::string_view path) {
  while (!pattern.empty() && pattern.front() != '*') {
    if (path.empty() || path.front() != pattern.front()) return false;
    pattern.remove_prefix(1);
    path.remove_prefix(1);
  }
  if (pattern.empty()) return path.empty();
  if (pattern == "**") return true;

  // A star takes as many characters as needed, but no slash
  const std::string_view rest = pattern.substr(1);
  for (std::size_t taken = 0;; ++taken) {
    if (matches(rest, path.substr(taken))) return true;
    if (taken == path.size() || path[taken] == '/') return false;
  }
}

bool is_one_of(const std::string& path, const FileNames& names) {
  return std::any_of(names.begin(), names.end(),
                     [&](const std::string& name) { return matches(name, path); });
}

/// The file for which OutputFile writes `path` first: "a/b.ply" for "a/.b.ply.4711.part"; "": it is no such.
std::string target_of(const std::string& path) {
  constexpr std::string_view kEnding = ".part";
  const std::size_t begin = path.rfind('/') == std::string::npos ? 0 : path.rfind('/') + 1;
  if (path.size() < begin + kEnding.size() || path[begin] != '.') return "";
  if (path.compare(path.size() - kEnding.size(), kEnding.size(), kEnding) != 0) return "";

  const std::string name = path.substr(begin + 1, path.size() - kEnding.size() - begin - 1);
  const std::size_t dot = name.rfind('.');
  if (dot == std::string::npos || dot + 1 == name.size()) return "";
  const bool number = std::all_of(name.begin() + static_cast<std::ptrdiff_t>(dot) + 1, name.end(),
                                  [](unsigned char c) { return std::isdigit(c) != 0; });
  return number ? path.substr(0, begin) + name.substr(0, dot) : "";
}

/// True for a folder in which one of `names` may lie.
bool is_own_folder(const std::string& path, const FileNames& names) {
  for (const std::string& name : names) {
    for (std::size_t slash = name.find('/'); slash != std::string::npos; slash = name.find('/', slash + 1)) {
      const std::string_view folder = std::string_view(name).substr(0, slash);
      if (matches(folder, path) || (name.substr(slash) == "/**" && matches(name, path + "/"))) return true;
    }
  }
  return false;
}

/// Gives what files_below() gives; `ec` tells that a folder could not be listed, and the list is not whole.
std::vector<std::string> listed_below(const fs::path& folder, std::error_code& ec) {
  std::vector<std::string> files;
  for (fs::recursive_directory_iterator it(folder, ec), end; !ec && it != end; it.increment(ec)) {
    std::error_code unknown;
    const bool is_folder = fs::is_directory(it->symlink_status(unknown));
    if (is_folder && !fs::is_empty(it->path(), unknown)) continue;
    files.push_back(it->path().lexically_relative(folder).generic_string() + (is_folder ? "/" : ""));
  }
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace

bool is_own_file(const std::string& path, const FileNames& names) {
  if (is_one_of(path, names)) return true;
  const std::string target = target_of(path);
  return !target.empty() && is_one_of(target, names);
}

std::vector<std::string> files_below(const fs::path& folder) {
  std::error_code unlisted;
  return listed_below(folder, unlisted);
}

/// Files below the folder that do not match any of `names`: they belong to the user.
std::vector<std::string> foreign_files(const fs::path& folder, const FileNames& names) {
  std::vector<std::string> foreign;
  for (const std::string& file : files_below(folder)) {
    const bool own =
        file.back() == '/' ? is_own_folder(file.substr(0, file.size() - 1), names) : is_own_file(file, names);
    if (!own) foreign.push_back(file);
  }
  return foreign;
}

std::string list_of_files(const std::vector<std::string>& files) {
  constexpr std::size_t kMost = 3;
  std::string text;
  for (std::size_t i = 0; i < std::min(files.size(), kMost); ++i) text += (i == 0 ? "" : ", ") + files[i];
  if (files.size() > kMost) text += " and " + std::to_string(files.size() - kMost) + " more";
  return text;
}

Result<void> remove_own_files(const fs::path& folder, const FileNames& names) {
  std::error_code unlisted;
  const std::vector<std::string> files = listed_below(folder, unlisted);
  if (unlisted && unlisted != std::errc::no_such_file_or_directory)
    return output_error(folder.string() + ": cannot be listed (" + unlisted.message() + ")");

  std::set<std::string> folders;
  for (const std::string& file : files) {
    const bool is_folder = file.back() == '/';
    const std::string path = is_folder ? file.substr(0, file.size() - 1) : file;
    if (is_folder ? !is_own_folder(path, names) : !is_own_file(path, names)) continue;

    std::error_code ec;
    fs::remove(folder / path, ec);
    if (ec) return output_error((folder / path).string() + ": cannot be removed (" + ec.message() + ")");
    for (fs::path above = fs::path(path).parent_path(); !above.empty(); above = above.parent_path())
      folders.insert(above.generic_string());
  }

  // The deepest first: a path sorts behind those of the folders above it.
  std::error_code not_empty;
  for (auto it = folders.rbegin(); it != folders.rend(); ++it) fs::remove(folder / *it, not_empty);
  fs::remove(folder, not_empty);
  return {};
}

}  // namespace plumbline::core
